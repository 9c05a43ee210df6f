#pragma once
// The connection to the model server: joins, mirrors, reconnects and resumes by itself, and hands the newest
// state to the frame loop, which never waits for it (V5). A refused delta counts, leaves the picture as it
// was, and makes the feed join again: a reconnect is the same code as a late join (U3). While the server is
// gone the last picture stays, and when it is back the picture goes over to the new one in one step
// (resume.h).

#include <compare>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "client-hmd/mirror/acknowledgement.h"
#include "client-hmd/mirror/activity.h"
#include "client-hmd/mirror/control_net.h"
#include "client-hmd/mirror/latency.h"
#include "client-hmd/mirror/scene_mirror.h"
#include "common/base/clock.h"
#include "common/base/log.h"
#include "common/base/table_palette.h"
#include "common/net/endpoint.h"
#include "common/net/tls.h"
#include "proto/session.pb.h"

namespace handloft::client {

/// Whose activity: a client may have several hands, told apart by their names.
struct ActivityKey {
  std::uint64_t client_id = 0;
  std::string name;
  auto operator<=>(const ActivityKey&) const = default;
};

/// One consistent state of the connection.
struct ModelState {
  std::shared_ptr<const Scene> scene = std::make_shared<const Scene>();
  bool connected = false;
  std::string problem;  ///< Why it is not, in words.
  /// Why the server lets us not in, by its own word: revoked, no role here, another version. Null: it did, or
  /// could not be asked.
  std::optional<Error> denied;
  std::string refusal;          ///< What of the newest messages was refused, and why; empty: nothing.
  std::uint64_t snapshots = 0;  ///< Applied; 0: nothing was received yet.
  TimePoint received_at;        ///< When the newest message of the scene came.
  TimePoint last_heard;         ///< When anything came at all.
  TimePoint capture_time;       ///< Of the newest tracking frame that the server has seen, on our clock.
  bool has_capture_time = false;
  TimePoint scene_capture_time;  ///< The same, but only of what shaped `scene`, not of presence; 0: none.
  std::map<ActivityKey, Activity> activities;
  ControlNets control_nets;         ///< Of surfaces, the newest known; empty before they were wanted.
  std::uint64_t own_client_id = 0;  ///< As the server's Welcome named us; 0: not yet.
  std::shared_ptr<const std::vector<PersonHere>> people;  ///< Everybody on the model; null: not told.
  std::optional<VersionDifference> difference;            ///< As asked for last; null: never.
  v1::Role role = v1::ROLE_UNSPECIFIED;  ///< What the server lets us do; unspecified: not told.
  bool takes_hands = false;  ///< This server does something with an editor's hand, and we are one.
  /// The scene of a server that is just back, while it lacks some of what is shown; null: none.
  std::shared_ptr<const Scene> coming;
  TimePoint coming_until;  ///< From then on it is `scene`.
};

struct ModelFeedStatistics {
  std::uint64_t connects = 0;  ///< Handshakes; reconnects are one less.
  MirrorStatistics mirror;
  std::uint64_t activities_refused = 0;  ///< Presence with NaN and the like.
  LatencyHistogram capture_to_receipt;
  LatencyHistogram join_to_scene;  ///< From each handshake to its first snapshot, applied.
  LatencyHistogram outages;        ///< From each loss of the connection to the next snapshot, applied.
  std::uint64_t hands_sent = 0;
  std::uint64_t hands_dropped = 0;  ///< Nobody was there, or read too slowly.
  std::uint64_t requests_sent = 0;
  std::uint64_t requests_refused = 0;  ///< Here or by the server.
};

/// Whether control nets are to be asked for with every change of a surface.
enum class ControlNetWish { hidden, shown };

/// Who joins.
struct FeedOptions {
  v1::Role role = v1::ROLE_VIEWER;  ///< ROLE_COMMENTER and above: may send, too.
  std::string name;                 ///< Shown to others.
  /// With the same one we are the same client when we come again (client_key.h). Empty: a new one.
  std::string client_key;
  std::shared_ptr<const net::TlsContext> tls;  ///< For tls: endpoints.
};

class ModelFeed {
 public:
  /// Returns at once; connects, and reconnects, on a thread of its own. `clock` must outlive the feed.
  static std::unique_ptr<ModelFeed> start(const net::Endpoint& endpoint, const Clock& clock, Logger log) {
    return start(endpoint, clock, std::move(log), FeedOptions());
  }
  static std::unique_ptr<ModelFeed> start(const net::Endpoint& endpoint, const Clock& clock, Logger log,
                                          const FeedOptions& options);
  ~ModelFeed();
  ModelFeed(const ModelFeed&) = delete;
  ModelFeed& operator=(const ModelFeed&) = delete;

  /// The newest state. Any thread; never waits for the network.
  std::shared_ptr<const ModelState> state() const;
  ModelFeedStatistics statistics() const;

  /// Any thread; never waits; the same again costs nothing.
  void want_control_nets(ControlNetWish wish);

  /// Any thread; never waits. The answer comes as ModelState::difference. `to` empty: the present.
  void ask_difference(const std::string& from, const std::string& to);

  // Not for viewers. Any thread; never waits, and nothing is kept for a server that is not there: what a hand
  // did a while ago is not done when it comes back. Errors: failed_precondition when it is not connected, or
  // knows no hands (protocol 1.0); resource_exhausted when the server reads too slowly; permission_denied for
  // viewers.

  /// A frame of this client's own hand ("A hand of one's own" in PROTOCOL.md).
  Status send_hand(const v1::TrackingFrame& frame);
  /// What becomes of these comes with take_acknowledgements(), in order; of those whose connection broke a
  /// refusal that says so.
  Status send_command(PaletteCommand command, std::uint32_t hand = 0);
  Status submit(const v1::Operation& operation);
  std::vector<Acknowledgement> take_acknowledgements();

 private:
  struct Implementation;
  explicit ModelFeed(std::unique_ptr<Implementation> implementation);
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace handloft::client
