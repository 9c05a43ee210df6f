#pragma once
// Designs of tests/data/scripts as handloft-hmd has them: the script runs in a model, the scene is built and
// streamed, the messages go through their bytes into the mirror. What a golden view of them tells apart is
// the whole chain.

#include <compare>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "client-hmd/mirror/control_net.h"
#include "client-hmd/mirror/scene.h"
#include "common/base/result.h"

namespace handloft::client::test {

struct Design {
  std::string script;             ///< "computer_mouse"
  std::vector<std::string> more;  ///< Lines of script to be run after it.
  std::string selected;           ///< Id of what gestures act on.
  std::vector<std::string> targets;
  /// An addPoints or other operation as a line of script, in the air: not committed. Empty: none.
  std::string in_the_air;
  std::uint64_t by = 0;  ///< Whose gesture that is.
  auto operator<=>(const Design&) const = default;
};

/// Operations only: exports, queries and expectations are left out. The same design is made once a process.
Result<std::shared_ptr<const Scene>> design_scene(const Design& design);

/// The nets of control points that the server answers for the sculpted and fitted surfaces of a design.
Result<ControlNets> design_nets(const Design& design);

/// A copy, shown otherwise.
std::shared_ptr<const Scene> shown_as(const Scene& scene, Representation representation);
/// A copy in which one entity is changed.
std::shared_ptr<const Scene> changed(const Scene& scene, const std::string& id,
                                     const std::function<void(Entity&)>& change);

}  // namespace handloft::client::test
