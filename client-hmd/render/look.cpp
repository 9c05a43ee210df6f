#include "client-hmd/render/look.h"

#include <array>

namespace handloft::client {
namespace {

constexpr std::array<NamedChoice<Shading>, 6> shading_names{{
    {Shading::studio, "studio", "Studio light"},
    {Shading::clay, "clay", "Clay"},
    {Shading::car_paint, "car-paint", "Car paint"},
    {Shading::silver, "silver", "Silver"},
    {Shading::zebra, "zebra", "Zebra stripes"},
    {Shading::curvature, "curvature", "Curvature"},
}};

constexpr std::array<NamedChoice<CurvatureKind>, 4> kind_names{{
    {CurvatureKind::mean, "mean", "Mean curvature"},
    {CurvatureKind::gaussian, "gaussian", "Gaussian curvature"},
    {CurvatureKind::largest, "largest", "Largest curvature"},
    {CurvatureKind::smallest, "smallest", "Smallest curvature"},
}};

template <typename Choice, std::size_t size>
std::optional<Choice> find_name(const std::array<NamedChoice<Choice>, size>& names, std::string_view name) {
  for (const NamedChoice<Choice>& known : names) {
    if (known.name == name) return known.choice;
  }
  return std::nullopt;
}

template <typename Choice, std::size_t size>
std::size_t place_of(const std::array<NamedChoice<Choice>, size>& names, Choice choice) {
  for (std::size_t i = 0; i < size; ++i) {
    if (names[i].choice == choice) return i;
  }
  return 0;
}

}  // namespace

std::span<const NamedChoice<Shading>> shadings() {
  return shading_names;
}
std::span<const NamedChoice<CurvatureKind>> curvature_kinds() {
  return kind_names;
}

std::optional<Shading> shading_named(std::string_view name) {
  return find_name(shading_names, name);
}
std::optional<CurvatureKind> curvature_kind_named(std::string_view name) {
  return find_name(kind_names, name);
}

std::optional<SurfaceOverlays> overlays_named(std::string_view comma_separated) {
  SurfaceOverlays overlays;
  while (!comma_separated.empty()) {
    const std::size_t comma = comma_separated.find(',');
    const std::string_view word = comma_separated.substr(0, comma);
    comma_separated.remove_prefix(comma == std::string_view::npos ? comma_separated.size() : comma + 1);
    if (word == "wires") {
      overlays.wires = true;
    } else if (word == "net") {
      overlays.control_nets = true;
    } else if (word == "isophotes") {
      overlays.isophotes = true;
    } else if (word != "none") {
      return std::nullopt;
    }
  }
  return overlays;
}

std::string_view name_of(Shading shading) {
  return shading_names[place_of(shading_names, shading)].name;
}
std::string_view name_of(CurvatureKind kind) {
  return kind_names[place_of(kind_names, kind)].name;
}

Shading next_shading(Shading shading) {
  return shading_names[(place_of(shading_names, shading) + 1) % shading_names.size()].choice;
}
CurvatureKind next_curvature_kind(CurvatureKind kind) {
  return kind_names[(place_of(kind_names, kind) + 1) % kind_names.size()].choice;
}

SurfaceOverlays next_overlays(const SurfaceOverlays& overlays) {
  SurfaceOverlays next = overlays;
  next.wires = !overlays.wires;
  next.control_nets = overlays.wires ? !overlays.control_nets : overlays.control_nets;
  return next;
}

}  // namespace handloft::client
