#pragma once
// Other users between two messages of theirs (U1): presence comes 60 times a second at most, with the
// network's jitter, and a hand that jumps looks broken. So ghosts are shown a little behind what was heard,
// between two places that are known (PoseHistory); what was not heard of for a second fades away, and who is
// gone is gone at once. Times are of receipt: no clock but ours counts.

#include <functional>
#include <map>
#include <vector>

#include "client-hmd/mirror/model_feed.h"
#include "client-hmd/render/frame.h"
#include "client-hmd/view/pose_history.h"

namespace handloft::client {

struct GhostOptions {
  Duration delay = std::chrono::milliseconds(50);  ///< Three messages: two may come together or one late.
  Duration stale = std::chrono::seconds(1);        ///< Unheard of for so long, a ghost begins to fade ...
  Duration fade = std::chrono::milliseconds(400);  ///< ... and takes so long.
  Duration largest_gap = std::chrono::milliseconds(500);  ///< Not bridged beyond; slow senders still move.
};

/// Whose hand the server's own tracking follows (client 0).
enum class TrackedHand { ours, somebodys };

/// Whether `key` is a hand of this client.
bool is_ours(const ActivityKey& key, std::uint64_t own_client_id, TrackedHand tracked);

class GhostTracker {
 public:
  explicit GhostTracker(GhostOptions options = {}) : options_(options) {}

  /// Once a frame: remembers what is new and forgets who is gone.
  void take(const ModelState& model, TrackedHand tracked);
  /// Who is seen at `now`; `colour` in linear RGB by client.
  std::vector<GhostHint> at(TimePoint now, const std::function<glm::vec3(std::uint64_t)>& colour) const;

 private:
  struct Ghost {
    Activity activity;  ///< The newest.
    std::array<PoseHistory, tips_of_a_hand> tips;
    PoseHistory head;
  };
  PoseHistory history() const;
  Ghost begin() const;
  static void push(Ghost& ghost, const Activity& activity);

  GhostOptions options_;
  std::map<ActivityKey, Ghost> ghosts_;
};

}  // namespace handloft::client
