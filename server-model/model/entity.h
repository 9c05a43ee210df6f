#pragma once
// What a document holds: entities of several kinds, each immutable once it is in a document and shared by all
// documents that have it (architecture idea 3).

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <string_view>

namespace handloft::model {

enum class EntityKind : std::uint8_t { dual_shape, reference, sculpt_surface, cad_model };

std::string_view to_string(EntityKind kind);  ///< "dual_shape", "reference", "sculpt_surface", "cad_model"

struct Similarity;

/// What all kinds have in common.
struct Entity {
  std::string id;
  std::string name;  ///< Shown to people.
  /// What has moved it as a whole so far, null: nothing; so that what is pinned to it goes along. Not part of
  /// its canonical form.
  std::shared_ptr<const Similarity> motion;

  virtual ~Entity() = default;
  virtual EntityKind kind() const = 0;
  /// A copy that may be changed before it goes into a document; large parts stay shared.
  virtual std::shared_ptr<Entity> clone() const = 0;

 protected:
  Entity() = default;
  Entity(const Entity&) = default;
  Entity(Entity&&) = default;
  Entity& operator=(const Entity&) = default;
  Entity& operator=(Entity&&) = default;
};
using EntityPtr = std::shared_ptr<const Entity>;
using Entities = std::map<std::string, EntityPtr, std::less<>>;  ///< By id.

}  // namespace handloft::model
