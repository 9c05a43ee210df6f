#pragma once
// The scene as viewers are to see it at one moment: the document with the gestures in the air on top, and the
// geometry derived from it. A value that shares everything with the document (architecture ideas 3 and 5), so
// that any thread may read it while the model goes on.

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "proto/scene.pb.h"
#include "server-model/model/dual_shape.h"

namespace handloft::stream {

/// What hands or 3D mice are about to do, or do, with an icon of a sculpted surface.
struct IconMark {
  enum class Kind : std::uint8_t {
    target,  ///< Would be picked now.
    held,    ///< Is driven now.
  };
  std::string entity;
  std::string icon;
  Kind kind = Kind::target;

  bool operator==(const IconMark&) const = default;
};

/// Who shapes an entity for some seconds (U1).
struct LeaseMark {
  std::uint64_t client_id = 0;  ///< 0: the hand that the server's own tracking follows.
  std::string name;             ///< Empty: nobody.
  bool operator==(const LeaseMark&) const = default;
};

/// What all hands together point out in the scene.
struct HandMarks {
  std::vector<std::string> active;   ///< Ids of what gestures and commands act on.
  std::vector<std::string> targets;  ///< Ids of what hands act on now, or would.
  std::vector<IconMark> icons;
  std::map<std::string, LeaseMark> leases = {};  ///< By entity.
};

struct SceneEntity {
  model::EntityPtr entity;  ///< Never null.
  std::uint64_t revision = 0;
  /// Of a dual shape: since this revision nothing happened to its points but that others came behind them.
  std::uint64_t points_grow_since = 0;
  bool provisional = false;
  std::uint64_t provisional_by = 0;  ///< With `provisional`: whose gesture, as EntityState.provisional_by.
  bool selected = false;             ///< Of any source of hands.
  bool target = false;               ///< A hand acts on it now, or would.
  std::vector<IconMark> icon_marks;  ///< Of this entity.
  LeaseMark lease;
  /// Packed triangles of a dual shape's fit, a reference, a sculpted surface or what is not sculptable of a
  /// CAD model; null: not fitted, or not yet made.
  std::shared_ptr<const v1::Mesh> surface;
  /// Of the surface's vertices to the nearest reference (EntityState.distances); null: no reference, or not
  /// yet measured.
  std::shared_ptr<const std::string> distances;
  /// Of this surface with these distances, in this epoch (EntityState.surface_id); 0: there is none.
  std::uint64_t surface_id = 0;

  bool operator==(const SceneEntity&) const = default;  ///< By identity of what is shared.
};

struct Scene {
  std::uint64_t epoch = 0;
  std::uint64_t sequence = 0;
  std::int64_t capture_time_ns = 0;  ///< Of the newest tracking frame that shaped it; 0: none.
  std::map<std::string, SceneEntity> entities;
  v1::HistoryState history;  ///< Of all who work on it together; see Personal.
  /// Of each viewer's own steps, by client; never null, and the same pointer while they are the same.
  std::shared_ptr<const std::map<std::uint64_t, v1::HistoryState>> histories =
      std::make_shared<const std::map<std::uint64_t, v1::HistoryState>>();
  v1::AlternativesState alternatives;
  /// Of the document; never null, and the same pointer while it is the same.
  std::shared_ptr<const v1::CommentsState> comments = std::make_shared<const v1::CommentsState>();
  std::shared_ptr<const v1::VersionsState> versions = std::make_shared<const v1::VersionsState>();
};
using ScenePtr = std::shared_ptr<const Scene>;

/// What goes with a scene to one viewer.
struct Personal {
  v1::HistoryState history;  ///< Of its own steps (U1).
  v1::StorageState storage;  ///< As it is at the moment of sending: newer than the scene (U5).
};

}  // namespace handloft::stream
