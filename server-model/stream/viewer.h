#pragma once
// What one viewer has, and what to send it next (architecture idea 5): a snapshot to begin with, then what
// differs between what it has and the scene as it is at the moment of sending. So a slow viewer is never sent
// a backlog, a late joiner is no special case, and a growing stroke costs its new points only. One that comes
// again and says what it holds (U3) goes on from there.

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "proto/session.pb.h"
#include "server-model/stream/pack_cache.h"
#include "server-model/stream/scene.h"

namespace handloft::stream {

struct ViewerLimits {
  /// Larger scenes are sent in several messages: composing one takes the others' time, some milliseconds a
  /// MiB (bench_session_join).
  std::size_t max_message_bytes = 1U << 20;
  std::size_t max_points_per_message = 50'000;  ///< 14 bytes each: 0.7 MB
  /// What a Join may say that it holds; one that says more begins with a snapshot.
  std::size_t max_held = 100'000;
};

/// How a viewer reads meshes.
enum class MeshReading : std::uint8_t {
  residuals,       ///< As they are packed.
  vertex_streams,  ///< Of protocol 1.2 and before: packed again for such viewers.
};

/// How many leading points of two clouds look alike (position and pressure). O(chunks) when they share their
/// elements.
std::size_t common_prefix(const model::PointCloud& a, const model::PointCloud& b);

/// Points [first, end) as viewers get them: quantised, with the fuzzy styles they use (A2, A3).
/// Errors: those of codec::encode_points().
Result<v1::PointCloud> pack_points(const model::PointCloud& points, std::size_t first, std::size_t end);

/// Not thread-safe.
class Viewer {
 public:
  /// `packs`: what viewers of the same scenes share; null: this one packs all anew.
  explicit Viewer(ViewerLimits limits = {}, MeshReading reading = MeshReading::residuals,
                  std::shared_ptr<PackCache> packs = nullptr)
      : limits_(limits), reading_(reading), packs_(std::move(packs)) {}

  /// The next message towards `scene`: a SceneSnapshot first, then SceneDelta; nullopt when the viewer has it
  /// all. The message counts as delivered.
  std::optional<v1::Envelope> next(const Scene& scene, const Personal& own);
  /// For viewers without steps of their own, of what is not kept.
  std::optional<v1::Envelope> next(const Scene& scene) { return next(scene, Personal{scene.history, {}}); }

  /// The viewer has nothing (any more): the next message is a snapshot.
  void reset();
  /// Begins with what a viewer says that it holds of this epoch: the next message is a delta on that, and
  /// comes in any case. What it says of points counts only where it has the newest revision of the entity, or
  /// one since which the cloud has only grown; a surface that is still the same one is not sent again in any
  /// case. False: that is of no use (another epoch, too much), and the next message is a snapshot.
  bool resume(const v1::Join& join, const Scene& scene);
  /// What resume() will say of it. Thread-safe, O(1).
  bool can_resume(const v1::Join& join, const Scene& scene) const;

  /// next() would send nothing for the sake of this.
  bool has_been_told(const v1::StorageState& storage) const;
  /// Bytes of geometry that only this viewer keeps in memory, since the scene has gone on meanwhile. About;
  /// O(entities).
  std::size_t stale_bytes(const Scene& scene) const;

 private:
  struct Held {
    SceneEntity entity;
    std::size_t points = 0;  ///< Of a dual shape's, from the first: large clouds go in pieces.
    std::shared_ptr<const v1::Mesh> surface;
    std::shared_ptr<const std::string> distances;
    bool unsure = false;   ///< It holds the geometry; of the rest it has not said what it knows.
    bool unknown = false;  ///< It holds something older: all but the surface is to be told anew.
  };
  bool is_current(const Held& held, const SceneEntity& entity) const;
  void update(Held& held, const std::string& id, const SceneEntity& entity, v1::EntityState& state) const;
  void update_dual(Held& held, const model::DualPtr& shape, const SceneEntity& entity,
                   v1::EntityState& state) const;

  /// The surface with its distances, when either is not what the viewer has.
  void update_surface(Held& held, const SceneEntity& entity, v1::EntityState& state) const;

  ViewerLimits limits_;
  MeshReading reading_;
  std::shared_ptr<PackCache> packs_;
  bool begun_ = false;
  std::uint64_t sequence_ = 0;
  bool told_ = false;  ///< What follows was sent once.
  Personal own_;
  v1::AlternativesState alternatives_;
  std::shared_ptr<const v1::CommentsState> comments_;
  std::shared_ptr<const v1::VersionsState> versions_;
  std::map<std::string, Held> held_;
};

}  // namespace handloft::stream
