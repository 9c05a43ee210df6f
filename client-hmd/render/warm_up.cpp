#include "client-hmd/render/warm_up.h"

#include <memory>
#include <string>

#include "client-hmd/view/orbit_camera.h"

namespace handloft::client {
namespace {

constexpr float side_m = 0.01F;

/// A triangle whose corners fade, and one that is opaque.
std::shared_ptr<const SurfaceMesh> two_triangles() {
  auto mesh = std::make_shared<SurfaceMesh>();
  constexpr Vec3f up{0.0F, 0.0F, 1.0F};
  for (const float opacity : {1.0F, 0.3F}) {
    const float x = opacity < 1.0F ? side_m : 0.0F;
    mesh->vertices.push_back({{x, 0.0F, side_m}, up, 1.0F});
    mesh->vertices.push_back({{x + side_m, 0.0F, side_m}, up, opacity});
    mesh->vertices.push_back({{x, side_m, side_m}, up, opacity});
  }
  mesh->indices = {0, 1, 2, 3, 4, 5};
  return mesh;
}

std::shared_ptr<const PointSet> one_point() {
  auto set = std::make_shared<PointSet>();
  set->styles.push_back({side_m, {0.01F, 0.008F, 0.006F, 0.004F, 0.002F}, {0.1F, 0.2F, 0.3F, 0.4F, 0.5F}});
  set->points.push_back({{0.0F, 0.0F, side_m}, 0});
  return set;
}

SceneCurve line(CurveKind kind) {
  SceneCurve curve;
  curve.points = {{0.0F, 0.0F, side_m}, {side_m, 0.0F, side_m}, {side_m, side_m, side_m}};
  curve.kind = kind;
  return curve;
}

std::shared_ptr<const std::vector<SceneIcon>> icons() {
  std::vector<SceneIcon> all;
  for (const IconShape shape : {IconShape::point, IconShape::curve, IconShape::region}) {
    SceneIcon icon;
    icon.id = std::to_string(all.size());
    icon.shape = shape;
    icon.place = {0.0F, side_m, side_m};
    icon.direction = Vec3f{0.0F, 0.0F, 1.0F};
    icon.outline = {{0.0F, 0.0F, side_m}, {side_m, 0.0F, side_m}, {0.0F, side_m, side_m}};
    icon.label = "R";
    icon.target = shape == IconShape::point;
    all.push_back(std::move(icon));
  }
  return std::make_shared<const std::vector<SceneIcon>>(std::move(all));
}

std::shared_ptr<const Scene> a_little_of_everything() {
  auto scene = std::make_shared<Scene>();
  for (const EntityKind kind : {EntityKind::dual_shape, EntityKind::reference}) {
    auto entity = std::make_shared<Entity>();
    entity->id = kind == EntityKind::reference ? "reference" : "shape";
    entity->kind = kind;
    entity->representation = Representation::both;
    entity->surface = two_triangles();
    if (kind == EntityKind::dual_shape) {
      entity->selected = true;
      entity->points = one_point();
      entity->distances_m =
          std::make_shared<const std::vector<float>>(entity->surface->vertices.size(), 0.0F);
      entity->curves = std::make_shared<const std::vector<SceneCurve>>(
          std::vector{line(CurveKind::curve), line(CurveKind::profile), line(CurveKind::boundary)});
      entity->icons = icons();
    }
    scene->entities.emplace(entity->id, std::move(entity));
  }
  return scene;
}

GhostHint somebody() {
  GhostHint ghost;
  ghost.client_id = 1;
  ghost.name = "Ghost";
  ghost.doing = "pushing";
  ghost.entity = "shape";
  for (std::size_t i = 0; i < ghost.tips.size(); ++i) {
    ghost.tips[i] = HandTip{glm::vec3(0.02F * static_cast<float>(i), 0.0F, 0.05F), 1.0F};
  }
  ghost.head = RigidPose{glm::dvec3(0.0, 0.3, 0.3), glm::dquat(1.0, 0.0, 0.0, 0.0)};
  ghost.disk = DiskHint{glm::vec3(0.0F, 0.0F, 0.05F), glm::vec3(0.0F, 0.0F, 1.0F), 0.03F, 0.5F, ghost.colour};
  ghost.curve = std::make_shared<const SceneCurve>(line(CurveKind::curve));
  return ghost;
}

Overlay words() {
  Overlay overlay;
  overlay.panels.push_back({{4.0F, 4.0F}, {8.0F, 8.0F}, 2.0F, {1.0F, 1.0F, 1.0F, 0.5F}});
  overlay.texts.push_back({"words", {4.0F, 12.0F}, 8.0F, {0.0F, 0.0F, 0.0F, 1.0F}, TextAlign::left});
  return overlay;
}

void add_film(Frame& frame) {
  constexpr int side_px = 4;
  FilmedPicture film;
  film.image = std::make_shared<const Image>(
      Image{side_px, side_px, std::vector<std::uint8_t>(std::size_t{4} * side_px * side_px, 128)});
  film.serial = ~std::uint64_t{0};  // No film begins with it.
  film.camera = centred_pinhole(side_px, side_px, 1.0);
  frame.film = std::move(film);
  FilmedHand hand;
  hand.tips = somebody().tips;
  frame.filmed_hand = hand;
}

}  // namespace

std::vector<Frame> warm_up_frames(int width_px, int height_px) {
  Frame empty;
  empty.eye = OrbitCamera().eye(width_px, height_px);
  empty.overlay = words();

  Frame full = empty;
  full.scene = a_little_of_everything();
  full.fingers = {{{0.0F, 0.0F, 0.05F}, glm::vec3(0.5F), 1.0F},
                  {{0.02F, 0.0F, 0.05F}, glm::vec3(0.5F), 0.5F}};
  full.pressure = PressureMark{glm::vec3(0.0F, 0.0F, 0.05F), 0.5F, true};
  full.cursor = CursorMark{};
  full.symmetry = SymmetryHint{};
  full.disks.push_back(*somebody().disk);
  full.air_curves.push_back(std::make_shared<const SceneCurve>(line(CurveKind::profile)));
  full.ghosts.push_back(somebody());
  full.pins.push_back({glm::vec3(0.0F, 0.0F, 0.05F), 1, glm::vec3(0.5F)});
  full.sheets.push_back(
      {glm::vec3(0.0F), glm::vec3(1.0F, 0.0F, 0.0F), glm::vec3(0.0F, -1.0F, 0.0F), words()});
  full.touched = PaletteCommand{};

  Frame filmed = full;
  add_film(filmed);
  filmed.overlays = {.wires = true, .control_nets = true, .isophotes = true};
  auto net = std::make_shared<ControlNet>();
  net->rows = net->columns = 2;
  net->points = {
      {0.0F, 0.0F, side_m}, {side_m, 0.0F, side_m}, {0.0F, side_m, side_m}, {side_m, side_m, side_m}};
  filmed.control_nets.emplace("shape", std::move(net));
  filmed.distances = DistanceScale{};
  // The empty one last, too: nothing of the others is left in any pass then.
  return {empty, full, filmed, empty};
}

}  // namespace handloft::client
