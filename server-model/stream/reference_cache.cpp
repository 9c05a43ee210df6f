#include "server-model/stream/reference_cache.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

#include "common/codec/mesh_codec.h"

namespace handloft::stream {

Result<v1::Mesh> reference_mesh(const model::ReferenceMesh& mesh) {
  constexpr std::uint8_t opaque = 255;
  std::vector<geometry::Vec3> normals(mesh.positions.size(), geometry::Vec3::Zero());
  const auto at = [&](std::uint32_t i) {
    const auto& [x, y, z] = mesh.positions[i];
    return geometry::Vec3(double{x}, double{y}, double{z});
  };
  for (const auto& [a, b, c] : mesh.triangles) {
    const geometry::Vec3 weighted = (at(b) - at(a)).cross(at(c) - at(a));  // By area.
    for (const std::uint32_t corner : {a, b, c}) normals[corner] += weighted;
  }
  codec::MeshData packed;
  packed.positions = mesh.positions;
  packed.opacity.assign(mesh.positions.size(), opaque);
  packed.normals.reserve(mesh.positions.size());
  for (const geometry::Vec3& sum : normals) {
    const double length = sum.norm();
    const geometry::Vec3 normal = length > 0 ? geometry::Vec3(sum / length) : geometry::Vec3::UnitZ();
    packed.normals.push_back(
        {static_cast<float>(normal.x()), static_cast<float>(normal.y()), static_cast<float>(normal.z())});
  }
  packed.indices.reserve(3 * mesh.triangles.size());
  for (const auto& triangle : mesh.triangles) {
    packed.indices.insert(packed.indices.end(), triangle.begin(), triangle.end());
  }
  return codec::encode_mesh(packed);
}

Result<std::string> vertex_distances(
    const v1::Mesh& surface, std::span<const std::shared_ptr<const model::ReferenceMesh>> references) {
  const auto mesh = codec::decode_mesh(surface);
  if (!mesh) return mesh.error();
  std::vector<geometry::Vec3> points;
  points.reserve(mesh->positions.size());
  for (const auto& [x, y, z] : mesh->positions) points.emplace_back(double{x}, double{y}, double{z});
  std::vector<double> nearest;
  std::vector<double> distances(points.size());
  for (const auto& reference : references) {
    const geometry::MeshDistance* const measure = reference->distance();
    if (measure == nullptr) continue;
    if (auto status = measure->signed_distances(points, distances); !status) return status.error();
    if (nearest.empty()) nearest = distances;
    for (std::size_t i = 0; i < distances.size(); ++i) {
      if (std::abs(distances[i]) < std::abs(nearest[i])) nearest[i] = distances[i];
    }
  }
  if (nearest.size() != points.size()) {
    return make_error(ErrorCode::failed_precondition, "there is no reference to measure to", "references");
  }
  std::string bytes;
  bytes.reserve(4 * nearest.size());
  for (const double distance : nearest) {
    const auto bits = std::bit_cast<std::uint32_t>(static_cast<float>(distance));
    for (unsigned k = 0; k < 4; ++k) bytes.push_back(static_cast<char>((bits >> (8U * k)) & 0xffU));
  }
  return bytes;
}

ReferenceCache::ReferenceCache(Run run, std::function<void()> ready, std::size_t max_unused)
    : run_(std::move(run)), ready_(std::move(ready)), max_unused_(max_unused) {}

std::shared_ptr<ReferenceCache::Entry> ReferenceCache::find(const std::shared_ptr<const v1::Mesh>& surface,
                                                            const Meshes& references) {
  std::shared_ptr<Entry> entry;
  {
    const std::lock_guard lock(mutex_);
    const auto found = std::find_if(entries_.begin(), entries_.end(), [&](const auto& candidate) {
      return candidate->surface == surface && candidate->references == references;
    });
    if (found != entries_.end()) {
      entries_.splice(entries_.begin(), entries_, found);
      entries_.front()->used_in_round = round_;
      return entries_.front();
    }
    entry = std::make_shared<Entry>();
    entry->surface = surface;
    entry->references = references;
    entry->used_in_round = round_;
    entries_.push_front(entry);
  }
  run_([this, entry] { make(entry); });
  return entry;
}

std::shared_ptr<const v1::Mesh> ReferenceCache::find_mesh(
    const std::shared_ptr<const model::ReferenceMesh>& reference) {
  const std::shared_ptr<Entry> entry = find(nullptr, {reference});
  const std::lock_guard lock(mutex_);
  return entry->mesh;
}

std::shared_ptr<const std::string> ReferenceCache::find_distances(
    const std::shared_ptr<const v1::Mesh>& surface, const Meshes& references) {
  if (!surface || references.empty()) return nullptr;
  const std::shared_ptr<Entry> entry = find(surface, references);
  const std::lock_guard lock(mutex_);
  return entry->distances;
}

void ReferenceCache::make(const std::shared_ptr<Entry>& entry) {
  {
    const std::lock_guard lock(mutex_);
    if (std::find(entries_.begin(), entries_.end(), entry) == entries_.end()) return;  // Superseded.
  }
  std::shared_ptr<const v1::Mesh> mesh;
  std::shared_ptr<const std::string> distances;
  if (entry->surface) {
    auto made = vertex_distances(*entry->surface, entry->references);
    if (made) distances = std::make_shared<const std::string>(*std::move(made));
  } else {
    auto made = reference_mesh(*entry->references.front());
    if (made) mesh = std::make_shared<const v1::Mesh>(*std::move(made));
  }
  {
    const std::lock_guard lock(mutex_);
    entry->done = true;
    entry->mesh = std::move(mesh);
    entry->distances = std::move(distances);
  }
  ready_();
  // Seen first, then prepared: some 0.3 s for 300,000 triangles that no question has to wait for.
  if (!entry->surface) (void)entry->references.front()->distance();
}

void ReferenceCache::begin_round() {
  const std::lock_guard lock(mutex_);
  ++round_;
}

void ReferenceCache::end_round() {
  const std::lock_guard lock(mutex_);
  std::size_t unused = 0;
  for (auto entry = entries_.begin(); entry != entries_.end();) {
    const bool used = (*entry)->used_in_round == round_;
    const bool keep = used || ((*entry)->done && ++unused <= max_unused_);
    entry = keep ? std::next(entry) : entries_.erase(entry);
  }
}

}  // namespace handloft::stream
