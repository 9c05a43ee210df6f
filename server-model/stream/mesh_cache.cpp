#include "server-model/stream/mesh_cache.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace handloft::stream {
namespace {

std::array<float, 3> to_floats(const geometry::Vec3& v) {
  return {static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z())};
}

}  // namespace

Result<v1::Mesh> surface_mesh(const model::DualShape& shape, const geometry::TessellationOptions& options) {
  if (!shape.fit)
    return make_error(ErrorCode::failed_precondition, "\"" + shape.id + "\" is not fitted", "entity");
  const auto trim = shape.trim();
  if (!trim) return trim.error();
  const auto mesh = geometry::tessellate(shape.fit->surface, shape.fit->frame, *trim, options);
  if (!mesh) return mesh.error();

  constexpr double opaque = 255.0;
  codec::MeshData packed;
  packed.positions.reserve(mesh->positions.size());
  packed.normals.reserve(mesh->positions.size());
  packed.opacity.reserve(mesh->positions.size());
  for (const geometry::Vec3& position : mesh->positions) packed.positions.push_back(to_floats(position));
  for (const geometry::Vec3& normal : mesh->normals) packed.normals.push_back(to_floats(normal));
  for (const double opacity : mesh->opacity) {
    packed.opacity.push_back(static_cast<std::uint8_t>(std::lround(std::clamp(opacity, 0.0, 1.0) * opaque)));
  }
  packed.indices = mesh->indices;
  return codec::encode_mesh(packed);
}

MeshCache::MeshCache(Run run, std::function<void()> ready, MeshCacheOptions options)
    : run_(std::move(run)),
      ready_(std::move(ready)),
      options_(options),
      references_(run_, ready_, options.max_unused),
      sculpted_(run_, ready_, options.sculpting) {}

std::shared_ptr<const v1::Mesh> MeshCache::find(const model::DualShape& shape) {
  if (!shape.fit) return nullptr;
  std::shared_ptr<Entry> entry;
  {
    const std::lock_guard lock(mutex_);
    const auto found = std::find_if(entries_.begin(), entries_.end(), [&](const auto& candidate) {
      return candidate->fit == shape.fit && candidate->exponent == shape.superellipse_exponent &&
             candidate->boundary == shape.boundary;
    });
    if (found != entries_.end()) {
      entries_.splice(entries_.begin(), entries_, found);
      entries_.front()->used_in_round = round_;
      return entries_.front()->mesh;
    }
    entry = std::make_shared<Entry>();
    entry->fit = shape.fit;
    entry->exponent = shape.superellipse_exponent;
    entry->boundary = shape.boundary;
    entry->used_in_round = round_;
    entries_.push_front(entry);
    ++statistics_.pending;
  }
  run_([this, entry, shape] { make(entry, shape); });
  const std::lock_guard lock(mutex_);
  return entry->mesh;  // already there when the job ran at once
}

void MeshCache::make(const std::shared_ptr<Entry>& entry, const model::DualShape& shape) {
  {
    const std::lock_guard lock(mutex_);
    if (std::find(entries_.begin(), entries_.end(), entry) == entries_.end()) {
      --statistics_.pending;  // superseded while it waited
      return;
    }
  }
  Result<v1::Mesh> mesh = surface_mesh(shape, options_.tessellation);
  {
    const std::lock_guard lock(mutex_);
    --statistics_.pending;
    entry->done = true;
    if (mesh) {
      ++statistics_.made;
      entry->mesh = std::make_shared<const v1::Mesh>(*std::move(mesh));
    } else {
      ++statistics_.failed;  // seen in the report; the points stay visible
    }
  }
  ready_();
}

void MeshCache::begin_round() {
  references_.begin_round();
  sculpted_.begin_round();
  const std::lock_guard lock(mutex_);
  ++round_;
}

void MeshCache::end_round() {
  references_.end_round();
  sculpted_.end_round();
  const std::lock_guard lock(mutex_);
  std::size_t unused = 0;
  for (auto entry = entries_.begin(); entry != entries_.end();) {
    const bool used = (*entry)->used_in_round == round_;
    const bool keep = used || ((*entry)->done && ++unused <= options_.max_unused);
    entry = keep ? std::next(entry) : entries_.erase(entry);
  }
}

MeshCacheStatistics MeshCache::statistics() const {
  const SculptCache::Statistics sculpted = sculpted_.statistics();
  const std::lock_guard lock(mutex_);
  MeshCacheStatistics all = statistics_;
  all.made += sculpted.made;
  all.failed += sculpted.failed;
  all.pending += sculpted.pending;
  return all;
}

}  // namespace handloft::stream
