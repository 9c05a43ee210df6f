#pragma once
// Control nets (V3) are asked for, not streamed: this decides what to ask and when, and holds the answers.

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "client-hmd/mirror/control_net.h"
#include "client-hmd/mirror/scene.h"
#include "common/base/result.h"
#include "proto/session.pb.h"

namespace handloft::client {

struct ControlNetLimits {
  std::uint32_t max_points = 10'000;  ///< Of one entity; more would hide the surface.
  double max_coordinate_m = 1e4;
};

/// Errors: data_corrupt naming the field; resource_exhausted above the limits. A net has at least 2 x 2
/// points.
Result<ControlNet> read_control_net(const v1::ControlNetResult& message, const ControlNetLimits& limits = {});

/// Newest wins: at most one question under way for an entity, asked again when its revision has changed
/// since, and only while nets are shown. A refused question is not repeated before the next revision. One
/// thread.
class ControlNetAsker {
 public:
  /// Its requests are numbered from `first_request`, so that a connection's other questions are told apart.
  explicit ControlNetAsker(std::uint64_t first_request = 1'000'000'000) : next_request_(first_request) {}

  /// What to send now so that the nets of all surfaces that `scene` shows are known. Call with every new
  /// scene and after every answer, while nets are shown.
  std::vector<v1::Envelope> questions(const Scene& scene);
  /// An answer from the server; false when it is to no question of ours. A refusal or a bad net leaves the
  /// entity without one.
  bool take(const v1::Answer& answer);
  /// The connection broke: nothing is under way, everything is asked again.
  void forget();

  /// Those of entities that `questions` was last told of.
  const ControlNets& nets() const { return nets_; }

 private:
  struct Asked {
    std::uint64_t request = 0;   ///< Under way; 0: none.
    std::uint64_t revision = 0;  ///< Of the newest question.
    bool ever = false;
  };
  std::uint64_t next_request_;
  std::map<std::string, Asked> asked_;
  ControlNets nets_;
};

}  // namespace handloft::client
