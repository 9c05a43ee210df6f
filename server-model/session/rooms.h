#pragma once
// The models of one server (U1): one file each in a folder, an actor each while somebody is there. A model is
// opened when the first one joins it and closed when nobody has been there for a while; the first one stays.
// What is wrong with one file is told by its name and hurts no other model. Files are opened and closed one
// after another on a thread of their own, so that no model waits for another's recovery.

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/clock.h"
#include "common/base/log.h"
#include "common/base/result.h"
#include "common/base/work_queue.h"
#include "server-model/session/room.h"

namespace handloft::session {

/// What a model may be called: 1 to 64 letters, digits, '-', '_' and '.', the first one a letter or digit.
/// Errors: invalid_argument (field "join.model").
Status check_model_name(std::string_view name);

/// A folder's models keep their names with this behind.
inline constexpr std::string_view model_suffix = ".handloft";

/// Files of a folder that may be models, by name.
std::vector<std::string> model_names_in(const std::filesystem::path& folder);

struct RoomsOptions {
  enum class Create : std::uint8_t {
    nobody,
    owners,  ///< By joining a name that is not there.
  };
  std::filesystem::path folder = {};  ///< Empty: the first model is the only one.
  Create create = Create::owners;
  std::size_t max_models = 256;                    ///< Files in the folder; then none is made.
  std::size_t max_open = 32;                       ///< In memory at a time; more are refused.
  Duration close_after = std::chrono::minutes(5);  ///< Nobody was there for so long.
  /// Opens a file, or makes it when it is not there. Empty: models that are not kept (tests).
  std::function<Result<OpenedModel>(const std::filesystem::path&)> open = {};
  /// Where files are opened and closed; null: a thread. Stopped by the rooms.
  std::shared_ptr<WorkQueue> queue = {};
};

/// Thread-safe.
class Rooms {
 public:
  /// Makes the actor of a model that was opened.
  using Furnish = std::function<RoomPtr(std::string name, OpenedModel model)>;
  using Entered = std::function<void(Result<RoomPtr>)>;
  enum class IfMissing : std::uint8_t { refuse, make };

  /// `first` is open as long as the rooms are. `clock` must outlive them.
  Rooms(RoomsOptions options, RoomPtr first, Furnish furnish, const Clock& clock, Logger log);
  ~Rooms();
  Rooms(const Rooms&) = delete;
  Rooms& operator=(const Rooms&) = delete;

  const RoomPtr& first() const { return first_; }
  /// Counts somebody in; leave() counts them out. `entered` is called once: at once when the model is open,
  /// else on the opening thread. An empty name is the first model. Errors: invalid_argument (a name that is
  /// none), not_found, resource_exhausted (too many), cancelled (stopping), those of opening a file.
  void enter(const std::string& name, IfMissing if_missing, const Entered& entered);
  void leave(const RoomPtr& room);
  /// All that are open.
  std::vector<RoomPtr> open_rooms() const;

  struct Listed {
    std::string name;
    std::size_t people = 0;
    bool open = false;
    /// Why it cannot be opened, or takes no more operations; empty: it can, as far as is known.
    std::string problem;
  };
  /// Those of the folder and those that are open, by name.
  std::vector<Listed> list() const;

  /// To be called a few times a second: closes what nobody uses.
  void tick();
  /// Closes all, and returns when all is on the disk.
  void stop();

 private:
  struct Entry {
    RoomPtr room;                  ///< Null: not open.
    std::vector<Entered> waiting;  ///< For it to be opened.
    std::size_t people = 0;
    TimePoint empty_since{};
    std::string problem;
  };
  std::filesystem::path path_of(const std::string& name) const;
  Status may_open(const std::string& name, IfMissing if_missing) const;
  void open(const std::string& name);

  const RoomsOptions options_;
  const RoomPtr first_;
  const Furnish furnish_;
  const Clock& clock_;
  Logger log_;
  std::shared_ptr<WorkQueue> queue_;

  mutable std::mutex mutex_;
  std::map<std::string, Entry> entries_;
  bool stopped_ = false;
};

}  // namespace handloft::session
