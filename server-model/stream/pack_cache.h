#pragma once
// What one viewer was sent of a scene is sent to the next one as well: points, and meshes for readers of an
// older protocol, packed once and shared by all who come or begin anew (C3, L2). Packing a scene of 50 MiB
// takes a core 0.1 s; without this, everybody who joins takes that from those who work (bench_session_join).
//
// An entry is of one immutable shape or mesh, known by identity: what changes is another one. It does not
// keep that alive, and is dropped when it is gone, or when nobody has asked for a while. When there is no
// room, what comes is not kept: whoever joins reads the whole scene in order, and making room for its end by
// dropping its beginning would leave nothing for the next one.

#include <chrono>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>

#include "common/base/clock.h"
#include "common/base/result.h"
#include "proto/scene.pb.h"
#include "server-model/model/dual_shape.h"

namespace handloft::stream {

struct PackCacheOptions {
  /// Of all packed messages together, as they lie in memory: a large scene (C3).
  std::size_t max_bytes = std::size_t{64} << 20;
  /// Smaller ones are packed faster than they are worth keeping: the steps of a stroke.
  std::size_t min_points = 1024;
  std::size_t min_mesh_bytes = std::size_t{16} << 10;
  /// Those who come together share; for somebody a minute later it may be packed again.
  Duration keep_for = std::chrono::seconds(30);
};

struct PackCacheStatistics {
  std::size_t bytes = 0;
  std::size_t entries = 0;
  std::uint64_t packed = 0;  ///< Also what was too small or too large to be kept.
  std::uint64_t shared = 0;  ///< Times that it was there already.
};

/// Thread-safe; nothing is locked while something is packed. Two who ask at the same time for the same may
/// both pack it.
class PackCache {
 public:
  using Points = std::shared_ptr<const v1::PointCloud>;
  using Mesh = std::shared_ptr<const v1::Mesh>;

  /// `clock` must outlive it.
  explicit PackCache(const Clock& clock, PackCacheOptions options = {}) : clock_(clock), options_(options) {}
  PackCache(const PackCache&) = delete;
  PackCache& operator=(const PackCache&) = delete;

  /// Points [first, end) of the shape. Errors: those of pack_points().
  Result<Points> points(const model::DualPtr& shape, std::size_t first, std::size_t end);
  /// As readers of protocol 1.2 have it. Errors: those of codec::as_vertex_streams().
  Result<Mesh> vertex_streams(const Mesh& mesh);

  /// To be called now and then: drops what is gone or was not asked for in `keep_for`. O(entries).
  void sweep();
  PackCacheStatistics statistics() const;

 private:
  struct Key {
    const void* source = nullptr;
    std::size_t first = 0;
    std::size_t end = 0;
    auto operator<=>(const Key&) const = default;
  };
  struct Entry {
    std::weak_ptr<const void> source;  ///< Expired: another one may have its address by now.
    Points points;                     ///< One of the two.
    Mesh mesh;
    std::size_t bytes = 0;
    TimePoint used;
  };

  /// Copied, so that it stays whatever becomes of the cache; neither: not there.
  Entry find(const Key& key);
  void keep(const Key& key, Entry entry);
  std::map<Key, Entry> take_old(TimePoint now);

  const Clock& clock_;
  const PackCacheOptions options_;
  mutable std::mutex mutex_;
  std::map<Key, Entry> entries_;
  PackCacheStatistics statistics_;
};

}  // namespace handloft::stream
