#include "server-model/stream/pack_cache.h"

#include <iterator>
#include <utility>

#include "common/codec/mesh_codec.h"
#include "server-model/stream/viewer.h"

namespace handloft::stream {

Result<PackCache::Points> PackCache::points(const model::DualPtr& shape, std::size_t first, std::size_t end) {
  const Key key{shape.get(), first, end};
  const bool large = end - first >= options_.min_points;
  if (large) {
    if (Entry found = find(key); found.points) return std::move(found.points);
  }
  auto packed = pack_points(shape->points, first, end);
  if (!packed) return packed.error();
  Entry made;
  made.source = shape;
  made.points = std::make_shared<const v1::PointCloud>(*std::move(packed));
  Points result = made.points;
  if (large) made.bytes = made.points->SpaceUsedLong();
  keep(key, std::move(made));
  return result;
}

Result<PackCache::Mesh> PackCache::vertex_streams(const Mesh& mesh) {
  const Key key{mesh.get(), 0, 0};
  if (Entry found = find(key); found.mesh) return std::move(found.mesh);
  auto plain = codec::as_vertex_streams(*mesh);
  if (!plain) return plain.error();
  Entry made;
  made.source = mesh;
  made.mesh = std::make_shared<const v1::Mesh>(*std::move(plain));
  Mesh result = made.mesh;
  const std::size_t bytes = made.mesh->SpaceUsedLong();
  if (bytes >= options_.min_mesh_bytes) made.bytes = bytes;
  keep(key, std::move(made));
  return result;
}

PackCache::Entry PackCache::find(const Key& key) {
  const TimePoint now = clock_.now();
  const std::lock_guard lock(mutex_);
  const auto found = entries_.find(key);
  // The caller holds what has this address now: is it what was packed?
  if (found == entries_.end() || found->second.source.expired()) return {};
  found->second.used = now;
  ++statistics_.shared;
  return found->second;
}

// Without bytes: it is only counted.
void PackCache::keep(const Key& key, Entry entry) {
  entry.used = clock_.now();
  std::map<Key, Entry> old;  // Freed when nobody waits for the lock any more.
  const std::lock_guard lock(mutex_);
  ++statistics_.packed;
  if (entry.bytes == 0) return;
  if (const auto before = entries_.find(key); before != entries_.end()) {
    statistics_.bytes -= before->second.bytes;
    entries_.erase(before);
  }
  if (statistics_.bytes + entry.bytes > options_.max_bytes) old = take_old(entry.used);
  if (statistics_.bytes + entry.bytes <= options_.max_bytes) {
    statistics_.bytes += entry.bytes;
    entries_.emplace(key, std::move(entry));
  }
  statistics_.entries = entries_.size();
}

std::map<PackCache::Key, PackCache::Entry> PackCache::take_old(TimePoint now) {
  std::map<Key, Entry> old;
  for (auto entry = entries_.begin(); entry != entries_.end();) {
    const auto next = std::next(entry);
    if (entry->second.source.expired() || now - entry->second.used >= options_.keep_for) {
      statistics_.bytes -= entry->second.bytes;
      old.insert(entries_.extract(entry));
    }
    entry = next;
  }
  statistics_.entries = entries_.size();
  return old;
}

void PackCache::sweep() {
  const TimePoint now = clock_.now();
  std::map<Key, Entry> old;
  const std::lock_guard lock(mutex_);
  old = take_old(now);
}

PackCacheStatistics PackCache::statistics() const {
  const std::lock_guard lock(mutex_);
  return statistics_;
}

}  // namespace handloft::stream
