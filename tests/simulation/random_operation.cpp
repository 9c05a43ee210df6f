#include "tests/simulation/random_operation.h"

#include <limits>
#include <string>
#include <vector>

namespace handloft::simulation {
namespace {

constexpr double table_m = 0.2;

void place(v1::Vec3& to, Random& random, double extent = table_m) {
  to.set_x(random.between(-extent, extent));
  to.set_y(random.between(-extent, extent));
  to.set_z(random.between(0, extent));
}

void points(v1::AddPoints& request, Random& random, std::uint64_t count) {
  v1::Vec3 start;
  place(start, random);
  for (std::uint64_t i = 0; i < count; ++i) {
    v1::Point& point = *request.add_points();
    place(*point.mutable_position(), random, 0.05);
    point.mutable_position()->set_x(point.position().x() + start.x());
    point.mutable_position()->set_y(point.position().y() + start.y());
    point.mutable_position()->set_z(0.1 * point.position().z());  // Flat enough to have a plane.
    point.set_pressure(random.unit());
  }
}

/// Something that is there, or was, or never was.
std::string some_entity(const client::Scene& seen, Random& random) {
  if (seen.entities.empty() || random.chance(0.03)) return "shape-" + std::to_string(random.below(20));
  auto one = seen.entities.begin();
  std::advance(one, static_cast<std::ptrdiff_t>(random.below(seen.entities.size())));
  return one->first;
}

v1::Operation nonsense(const client::Scene& seen, Random& random) {
  v1::Operation operation;
  const std::string entity = some_entity(seen, random);
  switch (random.below(7)) {
    case 0:  // No body.
      break;
    case 1: {
      auto& request = *operation.mutable_add_points();
      request.set_entity(entity);
      points(request, random, 3);
      request.mutable_points(1)->mutable_position()->set_y(std::numeric_limits<double>::quiet_NaN());
      break;
    }
    case 2:
      operation.mutable_fit()->set_entity("no such thing");
      break;
    case 3:
      operation.mutable_set_superellipse()->set_entity(entity);
      operation.mutable_set_superellipse()->set_exponent(-7);
      break;
    case 4:
      operation.mutable_transform()->add_entities(entity);
      operation.mutable_transform()->set_scale(std::numeric_limits<double>::infinity());
      break;
    case 5:
      operation.mutable_rename()->set_entity(entity);
      operation.mutable_rename()->set_name(std::string(100'000, 'x'));
      break;
    default:
      operation.mutable_drag_icon()->set_entity(entity);
      operation.mutable_drag_icon()->set_icon("no such icon");
      break;
  }
  return operation;
}

v1::Operation sculpting(const client::Scene& seen, Random& random) {
  v1::Operation operation;
  const client::Entity* surface = nullptr;
  for (const auto& [id, entity] : seen.entities) {
    if (entity->kind == client::EntityKind::sculpt_surface && (surface == nullptr || random.chance(0.5)))
      surface = entity.get();
  }
  if (surface == nullptr) {
    auto& request = *operation.mutable_create_sculpt_surface();
    request.mutable_rectangle()->set_width_m(0.2);
    request.mutable_rectangle()->set_depth_m(0.2);
    request.set_control_u(6);
    request.set_control_v(6);
  } else if (surface->icons == nullptr || surface->icons->empty() || random.chance(0.2)) {
    auto& request = *operation.mutable_add_icon();
    request.set_entity(surface->id);
    request.set_shape(v1::ICON_POINT);
    auto& at = *request.add_parameters();
    at.set_x(random.between(0.2, 0.8));
    at.set_y(random.between(0.2, 0.8));
  } else if (random.chance(0.15)) {
    operation.mutable_commit_sculpting()->set_entity(surface->id);
  } else {
    auto& request = *operation.mutable_drag_icon();
    request.set_entity(surface->id);
    request.set_icon(surface->icons->at(random.below(surface->icons->size())).id);
    request.mutable_translation()->set_z(random.between(-0.02, 0.02));
  }
  return operation;
}

/// Versions and comments.
v1::Operation words(const client::Scene& seen, Random& random) {
  v1::Operation operation;
  const auto some = [&](const char* what) { return what + std::to_string(1 + random.below(6)); };
  switch (random.below(6)) {
    case 0:
      operation.mutable_name_version()->set_name(some("version "));
      break;
    case 1:
      operation.mutable_restore_version()->set_name(some("version "));
      break;
    case 2:
      operation.mutable_delete_version()->set_name(some("version "));
      break;
    case 3:
      operation.mutable_change_comment()->set_id(some("comment-"));
      operation.mutable_change_comment()->set_resolved(random.chance(0.5));
      break;
    case 4:
      operation.mutable_delete_comment()->set_id(some("comment-"));
      break;
    default:
      operation.mutable_add_comment()->set_text("thinner here");
      if (random.chance(0.5)) operation.mutable_add_comment()->set_entity(some_entity(seen, random));
      place(*operation.mutable_add_comment()->mutable_place(), random);
      break;
  }
  return operation;
}

}  // namespace

v1::Operation random_operation(const client::Scene& seen, Random& random, const OperationMix& mix) {
  if (random.chance(mix.nonsense)) return nonsense(seen, random);
  v1::Operation operation;
  if (random.chance(mix.undo)) {
    operation.mutable_undo();
    if (random.chance(0.25)) operation.mutable_redo();
    return operation;
  }
  if (random.chance(mix.words)) return words(seen, random);
  if (random.chance(mix.sculpting)) return sculpting(seen, random);
  const std::string entity = some_entity(seen, random);
  switch (random.below(seen.entities.size() < 3 ? 4 : 16)) {
    case 0:
      operation.mutable_create_dual_shape()->set_name("shape");
      break;
    case 1:
    case 2:
    case 3:
    case 4:
    case 5:
    case 6: {
      auto& request = *operation.mutable_add_points();
      request.set_entity(entity);
      points(request, random, 1 + random.below(12));
      request.set_refit(random.chance(0.1));
      break;
    }
    case 7:
    case 8:
      operation.mutable_fit()->set_entity(entity);
      operation.mutable_fit()->set_degree(static_cast<std::uint32_t>(1 + random.below(3)));
      break;
    case 9:
      operation.mutable_rename()->set_entity(entity);
      operation.mutable_rename()->set_name("name " + std::to_string(random.below(100)));
      break;
    case 10: {
      auto& request = *operation.mutable_transform();
      request.add_entities(entity);
      place(*request.mutable_translation(), random, 0.02);
      break;
    }
    case 11: {
      auto& region = *operation.mutable_move_points();
      region.set_entity(entity);
      place(*region.mutable_region()->mutable_sphere()->mutable_centre(), random);
      region.mutable_region()->mutable_sphere()->set_radius_m(0.1);
      place(*region.mutable_by(), random, 0.01);
      break;
    }
    case 12: {
      auto& request = *operation.mutable_delete_points();
      request.set_entity(entity);
      request.mutable_region()->mutable_indices()->add_indices(static_cast<std::uint32_t>(random.below(12)));
      break;
    }
    case 13:
      operation.mutable_set_representation()->set_entity(entity);
      operation.mutable_set_representation()->set_representation(
          static_cast<v1::Representation>(1 + random.below(3)));
      break;
    case 14:
      if (seen.entities.size() > 6) {
        operation.mutable_delete_()->set_entity(entity);
      } else {
        operation.mutable_duplicate()->set_entity(entity);
        operation.mutable_duplicate()->mutable_translation()->set_x(0.05);
      }
      break;
    default: {
      const auto& names = seen.alternatives.names;
      if (names.size() < 3) {
        operation.mutable_new_alternative();
      } else {
        operation.mutable_switch_alternative()->set_name(names.at(random.below(names.size())));
      }
      break;
    }
  }
  return operation;
}

}  // namespace handloft::simulation
