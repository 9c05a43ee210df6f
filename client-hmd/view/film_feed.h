#pragma once
// The daemon's pictures from shared memory, newest wins: copied out and decoded when the frame loop asks for
// one, so that nobody decodes what nobody sees. Connecting happens on a thread of its own; the frame loop
// never waits (V5).

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "common/base/clock.h"
#include "common/base/log.h"
#include "common/base/result.h"
#include "common/net/endpoint.h"
#include "common/net/frame_ring.h"

namespace handloft::client {

/// RGBA, 8 bits, sRGB, rows from the top.
struct FilmFrame {
  std::uint32_t camera = 0;
  std::uint64_t serial = 0;  ///< Another number: another picture.
  TimePoint exposure_time;   ///< On the daemon's host, which is ours: memory is not shared across hosts.
  int width_px = 0;
  int height_px = 0;
  std::vector<std::uint8_t> rgba;
};

/// Turns a frame of the ring into RGBA. Errors: data_corrupt when sizes do not agree or the JPEG is broken;
/// resource_exhausted above 8192 px a side or 4096 x 2304 in all.
Result<std::vector<std::uint8_t>> decode_picture(const net::VideoFrame& frame);

class FilmFeed {
 public:
  /// `tracking`: the daemon's own endpoint; not for tcp, where the feed stays empty.
  static std::unique_ptr<FilmFeed> start(const net::Endpoint& tracking, Logger log);
  ~FilmFeed();
  FilmFeed(const FilmFeed&) = delete;
  FilmFeed& operator=(const FilmFeed&) = delete;

  /// The newest picture of `camera`; the one returned before when there is no newer; null when there is none
  /// at all. Called by one thread.
  std::shared_ptr<const FilmFrame> newest(std::uint32_t camera);
  /// The daemon was started anew: its memory is another one.
  void reconnect();

 private:
  struct Implementation;
  explicit FilmFeed(std::unique_ptr<Implementation> implementation);
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace handloft::client
