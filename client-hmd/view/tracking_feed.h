#pragma once
// The connection to the tracking daemon: keeps the histories of head, cameras and fingertips, so that the
// frame loop can ask where everything was at the exposure of the picture that it shows (V1) or will be when
// the display lights up (T8). Reconnects by itself; the frame loop never waits for the network (V5).

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client-hmd/view/pose_history.h"
#include "common/base/clock.h"
#include "common/base/log.h"
#include "common/net/endpoint.h"
#include "proto/tracking.pb.h"

namespace handloft::client {

inline constexpr std::size_t finger_count = 5;

/// A fingertip at the asked time; absent: lost.
struct FingerAnswer {
  glm::dvec3 position{0.0};
  bool seen = false;  ///< By a camera; otherwise predicted.
};

/// The first hand, as last heard.
struct HandStatus {
  v1::Gesture gesture = v1::GESTURE_UNKNOWN;
  double pressure = 0.0;  ///< 0..1
  bool pressing = false;
  bool glove_present = false;
  std::uint32_t battery_percent = 0;
};

/// A camera whose picture can stand behind the scene.
struct FilmCamera {
  std::uint32_t index = 0;
  std::string name;
  Pinhole pinhole;
  bool on_head = false;
};

struct TrackingStatus {
  bool connected = false;
  std::string problem;         ///< Why it is not, in words.
  std::uint64_t connects = 0;  ///< Handshakes.
  std::uint64_t frames = 0;
  std::uint64_t refused = 0;  ///< Frames or parts with NaN and the like.
  TimePoint received_at;      ///< Newest frame; meaningful with frames > 0.
  TimePoint capture_time;     ///< Of the newest frame, on our clock.
  bool end_of_recording = false;
  std::optional<HandStatus> hand;
  std::vector<FilmCamera> cameras;
  std::optional<std::array<std::uint32_t, finger_count>> finger_colours;  ///< sRGB as 0x00RRGGBB, if told.
};

/// What is kept of the stream; pure, without sockets. Not thread-safe.
class TrackingHistory {
 public:
  /// `to_local`: added to the daemon's times. Bad parts are passed over and counted; never fails.
  void add(const v1::TrackingFrame& frame, Duration to_local, TimePoint received);
  /// The stream begins anew.
  void clear();

  std::optional<PoseAnswer> head_at(TimePoint time) const { return head_.at(time); }
  std::optional<PoseAnswer> camera_at(std::uint32_t index, TimePoint time) const;
  std::array<std::optional<FingerAnswer>, finger_count> fingers_at(TimePoint time) const;
  TrackingStatus& status() { return status_; }
  const TrackingStatus& status() const { return status_; }

 private:
  static constexpr std::size_t max_cameras = 16;
  struct Camera {
    FilmCamera camera;
    PoseHistory poses;
  };
  void push(PoseHistory& history, const MeasuredPose& sample);
  void add_head(const v1::HeadState& head, TimePoint time);
  void add_hand(const v1::HandState& hand, TimePoint time);
  void add_camera(const v1::CameraState& state, Duration to_local);

  TrackingStatus status_;
  PoseHistory head_;
  std::array<PoseHistory, finger_count> fingers_;
  std::array<v1::TrackingState, finger_count> finger_states_{};
  std::vector<Camera> cameras_;
};

class TrackingFeed {
 public:
  /// Returns at once; connects, and reconnects, on a thread of its own. `clock` must outlive the feed.
  static std::unique_ptr<TrackingFeed> start(const net::Endpoint& endpoint, const Clock& clock, Logger log);
  ~TrackingFeed();
  TrackingFeed(const TrackingFeed&) = delete;
  TrackingFeed& operator=(const TrackingFeed&) = delete;

  // Any thread; each holds a lock for a lookup only.
  TrackingStatus status() const;
  std::optional<PoseAnswer> head_at(TimePoint time) const;
  std::optional<PoseAnswer> camera_at(std::uint32_t index, TimePoint time) const;
  std::array<std::optional<FingerAnswer>, finger_count> fingers_at(TimePoint time) const;

 private:
  struct Implementation;
  explicit TrackingFeed(std::unique_ptr<Implementation> implementation);
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace handloft::client
