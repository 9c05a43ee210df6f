#include "client-hmd/render/curvature.h"

#include <algorithm>
#include <cmath>
#include <glm/glm.hpp>
#include <limits>

namespace handloft::client {
namespace {

/// The contour of opacity 0.5 is where an export ends (A26): what is fainter is no part of the shape.
constexpr float seen_opacity = 0.5F;
constexpr float least_range_per_m = 0.1F;
/// Of a vertex's Voronoi area, relative to the square of the mean edge: below, its triangles are slivers.
constexpr float least_area_share = 1e-8F;

glm::vec3 vec(const Vec3f& v) {
  return {v.x, v.y, v.z};
}

/// A second fundamental form as a symmetric 3x3 tensor in world axes that is nought along the normal: forms
/// of different tangent planes can be added.
struct Tensor {
  float xx = 0, xy = 0, xz = 0, yy = 0, yz = 0, zz = 0;

  Tensor& operator+=(const Tensor& t) {
    xx += t.xx, xy += t.xy, xz += t.xz, yy += t.yy, yz += t.yz, zz += t.zz;
    return *this;
  }
  friend Tensor operator*(float s, const Tensor& t) {
    return {s * t.xx, s * t.xy, s * t.xz, s * t.yy, s * t.yz, s * t.zz};
  }
  glm::vec3 operator*(const glm::vec3& v) const {
    return {xx * v.x + xy * v.y + xz * v.z, xy * v.x + yy * v.y + yz * v.z, xz * v.x + yz * v.y + zz * v.z};
  }
};

/// e u u' + f (u v' + v u') + g v v'
Tensor tensor_of(const glm::vec3& form, const glm::vec3& u, const glm::vec3& v) {
  const auto entry = [&](int i, int j) {
    return form.x * u[i] * u[j] + form.y * (u[i] * v[j] + v[i] * u[j]) + form.z * v[i] * v[j];
  };
  return {entry(0, 0), entry(0, 1), entry(0, 2), entry(1, 1), entry(1, 2), entry(2, 2)};
}

/// `v` turned as `from` is turned into `to` on the shortest way; both unit, not opposite.
glm::vec3 turned(const glm::vec3& v, const glm::vec3& from, const glm::vec3& to) {
  const glm::vec3 axis = glm::cross(from, to);
  const float cosine = glm::dot(from, to);
  return v * cosine + glm::cross(axis, v) + axis * (glm::dot(axis, v) / (1.0F + cosine));
}

/// Least squares of  [du dv 0; 0 du dv] (e f g)' = (dn.u, dn.v)'  over the three edges: equation of section
/// 3.1. False for edges in one line.
bool fit_form(const std::array<glm::vec2, 3>& edges, const std::array<glm::vec2, 3>& normal_steps,
              glm::vec3& form) {
  float uu = 0, uv = 0, vv = 0;
  glm::vec3 right(0.0F);
  for (std::size_t i = 0; i < 3; ++i) {
    const glm::vec2& e = edges[i];
    const glm::vec2& d = normal_steps[i];
    uu += e.x * e.x;
    uv += e.x * e.y;
    vv += e.y * e.y;
    right += glm::vec3(e.x * d.x, e.x * d.y + e.y * d.x, e.y * d.y);
  }
  // [uu uv 0; uv uu+vv uv; 0 uv vv], whose determinant is (uu + vv)(uu vv - uv^2).
  const float area = uu * vv - uv * uv;
  const float determinant = (uu + vv) * area;
  if (!(determinant > 1e-9F * (uu + vv) * (uu + vv) * (uu + vv))) return false;
  const float middle = uu + vv;
  form.x = ((middle * vv - uv * uv) * right.x - uv * vv * right.y + uv * uv * right.z) / determinant;
  form.y = (-uv * vv * right.x + uu * vv * right.y - uu * uv * right.z) / determinant;
  form.z = (uv * uv * right.x - uu * uv * right.y + (uu * middle - uv * uv) * right.z) / determinant;
  return std::isfinite(form.x) && std::isfinite(form.y) && std::isfinite(form.z);
}

/// How the triangle's area is divided among its corners (Meyer et al. 2002: Voronoi where it is acute).
std::array<float, 3> corner_areas(const std::array<glm::vec3, 3>& edges, float area) {
  std::array<float, 3> squares{};
  for (std::size_t i = 0; i < 3; ++i) squares[i] = glm::dot(edges[i], edges[i]);
  for (std::size_t i = 0; i < 3; ++i) {
    // Edge i faces corner i.
    const std::size_t j = (i + 1) % 3, k = (i + 2) % 3;
    if (squares[j] + squares[k] <= squares[i]) {
      std::array<float, 3> areas{0.25F * area, 0.25F * area, 0.25F * area};
      areas[i] = 0.5F * area;
      return areas;
    }
  }
  std::array<float, 3> cotangents{};
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t j = (i + 1) % 3, k = (i + 2) % 3;
    cotangents[i] = -glm::dot(edges[j], edges[k]) / (2.0F * area);
  }
  std::array<float, 3> areas{};
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t j = (i + 1) % 3, k = (i + 2) % 3;
    areas[i] = (squares[j] * cotangents[j] + squares[k] * cotangents[k]) / 8.0F;
  }
  return areas;
}

struct Forms {
  std::vector<Tensor> tensors;  ///< Means.
  std::vector<float> areas;     ///< Of the vertices; nought: of no triangle.
  float mean_edge = 0.0F;
};

Forms mean_forms(std::span<const SurfaceVertex> vertices, std::span<const std::uint32_t> indices) {
  Forms forms;
  forms.tensors.resize(vertices.size());
  forms.areas.resize(vertices.size());
  double edge_sum = 0.0;
  std::size_t edge_count = 0;
  for (std::size_t t = 0; t + 2 < indices.size(); t += 3) {
    const std::array<std::uint32_t, 3> corner{indices[t], indices[t + 1], indices[t + 2]};
    if (std::any_of(corner.begin(), corner.end(), [&](std::uint32_t i) { return i >= vertices.size(); }))
      continue;
    std::array<glm::vec3, 3> place{}, normal{};
    for (std::size_t i = 0; i < 3; ++i) {
      place[i] = vec(vertices[corner[i]].position);
      normal[i] = vec(vertices[corner[i]].normal);
    }
    const std::array<glm::vec3, 3> edge{place[2] - place[1], place[0] - place[2], place[1] - place[0]};
    glm::vec3 face = glm::cross(edge[0], edge[1]);
    const float twice_area = glm::length(face);
    const float longest = std::max({glm::length(edge[0]), glm::length(edge[1]), glm::length(edge[2])});
    if (!(twice_area > 1e-6F * longest * longest)) continue;
    face /= twice_area;
    // The winding says nothing about the outside, the normals do.
    if (glm::dot(face, normal[0] + normal[1] + normal[2]) < 0.0F) face = -face;
    const glm::vec3 u = glm::normalize(edge[0]);
    const glm::vec3 v = glm::cross(face, u);
    std::array<glm::vec2, 3> steps{}, normal_steps{};
    for (std::size_t i = 0; i < 3; ++i) {
      const glm::vec3 difference = normal[(i + 2) % 3] - normal[(i + 1) % 3];
      steps[i] = {glm::dot(edge[i], u), glm::dot(edge[i], v)};
      normal_steps[i] = {glm::dot(difference, u), glm::dot(difference, v)};
      edge_sum += glm::length(edge[i]);
    }
    edge_count += 3;
    glm::vec3 form;
    if (!fit_form(steps, normal_steps, form)) continue;
    const std::array<float, 3> areas = corner_areas(edge, 0.5F * twice_area);
    for (std::size_t i = 0; i < 3; ++i) {
      // A triangle that looks the other way than its vertex's normal tells nothing.
      if (!(glm::dot(face, normal[i]) > 0.0F) || !(areas[i] > 0.0F)) continue;
      const Tensor tensor = tensor_of(form, turned(u, face, normal[i]), turned(v, face, normal[i]));
      forms.tensors[corner[i]] += areas[i] * tensor;
      forms.areas[corner[i]] += areas[i];
    }
  }
  if (edge_count > 0) forms.mean_edge = static_cast<float>(edge_sum / static_cast<double>(edge_count));
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    if (forms.areas[i] > least_area_share * forms.mean_edge * forms.mean_edge) {
      forms.tensors[i] = (1.0F / forms.areas[i]) * forms.tensors[i];
    } else {
      forms.tensors[i] = Tensor{};
      forms.areas[i] = 0.0F;
    }
  }
  return forms;
}

int smoothing_rounds(float mean_edge, const CurvatureOptions& options) {
  if (!(mean_edge > 0.0F) || !(options.wanted_noise_per_m > 0.0F)) return 0;
  // Of a difference of two normals; a vertex has about six triangles, that is a mean over as many.
  const float noise = 1.41F * options.normal_noise_rad / mean_edge / 2.45F;
  // n rounds average over about 3 (n + 1)^2 vertices, so that the noise falls with n + 1.
  const float rounds = std::ceil(noise / options.wanted_noise_per_m) - 1.0F;
  return static_cast<int>(std::clamp(rounds, 0.0F, static_cast<float>(std::max(0, options.max_smoothing))));
}

/// Each form becomes the mean of its own and its neighbours', by area.
void smooth(std::span<const std::uint32_t> indices, std::size_t vertex_count, Forms& forms) {
  std::vector<Tensor> sums(vertex_count);
  std::vector<float> weights(vertex_count, 0.0F);
  for (std::size_t t = 0; t + 2 < indices.size(); t += 3) {
    const std::array<std::uint32_t, 3> corner{indices[t], indices[t + 1], indices[t + 2]};
    if (std::any_of(corner.begin(), corner.end(), [&](std::uint32_t i) { return i >= vertex_count; }))
      continue;
    Tensor sum;
    float weight = 0.0F;
    for (const std::uint32_t i : corner) {
      sum += forms.areas[i] * forms.tensors[i];
      weight += forms.areas[i];
    }
    for (const std::uint32_t i : corner) {
      sums[i] += sum;
      weights[i] += weight;
    }
  }
  for (std::size_t i = 0; i < vertex_count; ++i) {
    if (weights[i] > 0.0F) forms.tensors[i] = (1.0F / weights[i]) * sums[i];
  }
}

/// Eigenvalues of the form in the tangent plane.
PrincipalCurvatures principal(const Tensor& tensor, const glm::vec3& normal) {
  const glm::vec3 helper =
      std::abs(normal.x) < 0.57F ? glm::vec3(1.0F, 0.0F, 0.0F) : glm::vec3(0.0F, 1.0F, 0.0F);
  const glm::vec3 u = glm::normalize(glm::cross(normal, helper));
  const glm::vec3 v = glm::cross(normal, u);
  const float e = glm::dot(u, tensor * u), f = glm::dot(u, tensor * v), g = glm::dot(v, tensor * v);
  const float mean = 0.5F * (e + g);
  const float spread = std::hypot(0.5F * (e - g), f);
  if (!std::isfinite(mean) || !std::isfinite(spread)) return {};
  return {mean + spread, mean - spread};
}

}  // namespace

std::vector<PrincipalCurvatures> vertex_curvatures(std::span<const SurfaceVertex> vertices,
                                                   std::span<const std::uint32_t> indices,
                                                   const CurvatureOptions& options) {
  Forms forms = mean_forms(vertices, indices);
  const int rounds = smoothing_rounds(forms.mean_edge, options);
  for (int i = 0; i < rounds; ++i) smooth(indices, vertices.size(), forms);
  std::vector<PrincipalCurvatures> curvatures;
  curvatures.reserve(vertices.size());
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    curvatures.push_back(principal(forms.tensors[i], vec(vertices[i].normal)));
  }
  return curvatures;
}

float curvature_value(const PrincipalCurvatures& curvatures, CurvatureKind kind) {
  switch (kind) {
    case CurvatureKind::mean:
      return 0.5F * (curvatures.largest + curvatures.smallest);
    case CurvatureKind::gaussian: {
      const float product = curvatures.largest * curvatures.smallest;
      return std::copysign(std::sqrt(std::abs(product)), product);
    }
    case CurvatureKind::largest:
      return curvatures.largest;
    case CurvatureKind::smallest:
      return curvatures.smallest;
  }
  return 0.0F;
}

float plain_number_above(float value) {
  constexpr std::array<float, 6> steps{1.0F, 1.5F, 2.0F, 3.0F, 5.0F, 7.5F};
  if (!(value > least_range_per_m)) return least_range_per_m;
  if (!std::isfinite(value)) return std::numeric_limits<float>::max();
  const float decade = std::pow(10.0F, std::floor(std::log10(value)));
  for (const float step : steps) {
    if (step * decade >= value * 0.9999F) return step * decade;
  }
  return 10.0F * decade;
}

float curvature_range(std::span<const PrincipalCurvatures> curvatures,
                      std::span<const SurfaceVertex> vertices, CurvatureKind kind, float share) {
  std::vector<float> sizes;
  for (std::size_t i = 0; i < std::min(curvatures.size(), vertices.size()); ++i) {
    if (vertices[i].opacity >= seen_opacity) sizes.push_back(std::abs(curvature_value(curvatures[i], kind)));
  }
  if (sizes.empty()) return least_range_per_m;
  const auto last = static_cast<float>(sizes.size() - 1);
  const auto at = static_cast<std::ptrdiff_t>(std::lround(std::clamp(share, 0.0F, 1.0F) * last));
  std::nth_element(sizes.begin(), sizes.begin() + at, sizes.end());
  return plain_number_above(sizes[static_cast<std::size_t>(at)]);
}

}  // namespace handloft::client
