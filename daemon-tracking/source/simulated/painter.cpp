#include "daemon-tracking/source/simulated/painter.h"

#include <algorithm>
#include <cmath>

namespace handloft::tracking {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

/// Matte caps: little between light and shadow, so that their hue stays what calibration saw.
constexpr float ball_shadow = 0.82f, ball_light = 0.18f;
constexpr float limb_shadow = 0.55f, limb_light = 0.45f;
/// An edge goes from 0 to 1 as a smooth step whose width has the variance of a Gaussian and of the pixel's
/// area: the smooth step over a width w has the variance w^2 / 20.
constexpr float step_variance = 20.0f, pixel_variance = 1.0f / 12.0f;
/// Things nearer than this, metres, are not drawn.
constexpr float nearest_m = 0.05f;

float smooth_step(float t) {
  const float u = std::clamp(t, 0.0f, 1.0f);
  return u * u * (3.0f - 2.0f * u);
}

std::uint8_t mixed(std::uint8_t under, float over, float alpha) {
  const float value = static_cast<float>(under) + alpha * (over - static_cast<float>(under));
  return static_cast<std::uint8_t>(std::clamp(value + 0.5f, 0.0f, 255.0f));
}

struct Cover {
  float alpha = 0, shade = 1;
};

struct Box {
  int x0, y0, x1, y1;  ///< x0 even, x1 and y1 exclusive, x1 even.
};

Box clipped(const ImagePlanes& image, const Rows& rows, float low_x, float low_y, float high_x,
            float high_y) {
  const auto clamp_to = [](float value, int limit) {
    return static_cast<int>(std::clamp(value, 0.0f, static_cast<float>(limit)));
  };
  return {clamp_to(std::floor(low_x), image.width) & ~1,
          std::max(rows.begin, clamp_to(std::floor(low_y), image.height)),
          std::min(image.width, (clamp_to(std::ceil(high_x) + 1, image.width) + 1) & ~1),
          std::min(rows.end, clamp_to(std::ceil(high_y) + 1, image.height))};
}

/// Blends a colour over the box; `cover(x, y)` tells how much of a pixel and how bright.
template <typename CoverAt>
void blend_box(ImagePlanes& image, const Box& box, const PaintColour& colour, CoverAt cover) {
  for (int y = box.y0; y < box.y1; ++y) {
    std::uint8_t* luma = image.y.data() + static_cast<std::ptrdiff_t>(y) * image.width;
    const std::ptrdiff_t chroma_row = static_cast<std::ptrdiff_t>(y) * image.chroma_width();
    for (int x = box.x0; x < box.x1; x += 2) {
      const Cover first = cover(x, y), second = cover(x + 1, y);
      const float alpha = 0.5f * (first.alpha + second.alpha);
      if (alpha <= 0.0f) continue;
      luma[x] = mixed(luma[x], colour.y * first.shade, first.alpha);
      luma[x + 1] = mixed(luma[x + 1], colour.y * second.shade, second.alpha);
      const float shade = 0.5f * (first.alpha * first.shade + second.alpha * second.shade) / alpha;
      std::uint8_t& cb = image.cb[static_cast<std::size_t>(chroma_row + x / 2)];
      std::uint8_t& cr = image.cr[static_cast<std::size_t>(chroma_row + x / 2)];
      cb = mixed(cb, 128.0f + (colour.cb - 128.0f) * shade, alpha);
      cr = mixed(cr, 128.0f + (colour.cr - 128.0f) * shade, alpha);
    }
  }
}

}  // namespace

Painter::Painter(const CameraIntrinsics& intrinsics, double edge_px)
    : lens_(intrinsics),
      edge_width_px_(std::sqrt(step_variance * (static_cast<float>(edge_px * edge_px) + pixel_variance))) {
  rays_.reserve(static_cast<std::size_t>(intrinsics.width_px) *
                static_cast<std::size_t>(intrinsics.height_px));
  for (int y = 0; y < intrinsics.height_px; ++y) {
    for (int x = 0; x < intrinsics.width_px; ++x) rays_.push_back(lens_.ray({x, y}).cast<float>());
  }
}

void Painter::add(Ball ball) {
  const Vector3f middle = ball.centres_m[ball.centres_m.size() / 2];
  if (!(middle.z() > nearest_m)) return;
  order_.push_back({middle.norm(), true, balls_.size()});
  balls_.push_back(std::move(ball));
}

void Painter::add(const Limb& limb) {
  if (!(limb.a_m.z() > nearest_m && limb.b_m.z() > nearest_m)) return;
  order_.push_back({(0.5f * (limb.a_m + limb.b_m)).norm(), false, limbs_.size()});
  limbs_.push_back(limb);
}

void Painter::paint(ImagePlanes& image, const Vector3f& up, const Rows& rows) {
  std::stable_sort(order_.begin(), order_.end(),
                   [](const Entry& a, const Entry& b) { return a.distance_m > b.distance_m; });
  for (const Entry& entry : order_) {
    if (entry.ball) {
      paint_ball(image, balls_[entry.index], up, rows);
    } else {
      paint_limb(image, limbs_[entry.index], rows);
    }
  }
  order_.clear();
  balls_.clear();
  limbs_.clear();
}

void Painter::paint_ball(ImagePlanes& image, const Ball& ball, const Vector3f& up, const Rows& rows) const {
  const CameraIntrinsics& intrinsics = lens_.intrinsics();
  const auto focal_px = static_cast<float>(0.5 * (intrinsics.fx_px + intrinsics.fy_px));
  float low_x = 1e9f, low_y = 1e9f, high_x = -1e9f, high_y = -1e9f;
  for (const Vector3f& centre : ball.centres_m) {
    const auto pixel = lens_.project(centre.cast<double>());
    if (!pixel) return;
    // The outline of a sphere off the axis is longer than its radius; twice holds for any lens below 100
    // degrees.
    const float reach = 2.0f * focal_px * ball.radius_m / centre.z() + edge_width_px_;
    const Vector2f at = pixel->cast<float>();
    low_x = std::min(low_x, at.x() - reach);
    low_y = std::min(low_y, at.y() - reach);
    high_x = std::max(high_x, at.x() + reach);
    high_y = std::max(high_y, at.y() + reach);
  }
  const Vector3f middle = ball.centres_m[ball.centres_m.size() / 2];
  const float share = 1.0f / static_cast<float>(ball.centres_m.size());
  const float radius2 = ball.radius_m * ball.radius_m;
  const Box box = clipped(image, rows, low_x, low_y, high_x, high_y);
  blend_box(image, box, ball.colour, [&](int x, int y) {
    const Vector2f& ray = rays_[static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width) +
                                static_cast<std::size_t>(x)];
    const float inverse_norm = 1.0f / std::sqrt(1.0f + ray.squaredNorm());
    const Vector3f direction(ray.x() * inverse_norm, ray.y() * inverse_norm, inverse_norm);
    Cover cover{0.0f, 1.0f};
    for (const Vector3f& centre : ball.centres_m) {
      const Vector3f beside = direction * direction.dot(centre) - centre;
      const float distance = beside.norm();
      // A pixel is cos / f wide as an angle across the ray, and the ball z / cos away.
      const float pixel_m = centre.z() / focal_px;
      cover.alpha += share * smooth_step(0.5f + (ball.radius_m - distance) / (pixel_m * edge_width_px_));
    }
    if (cover.alpha > 0.0f) {
      const Vector3f beside = direction * direction.dot(middle) - middle;
      const float depth2 = std::max(0.0f, radius2 - beside.squaredNorm());
      const Vector3f normal = (beside - direction * std::sqrt(depth2)) / ball.radius_m;
      cover.shade = ball_shadow + ball_light * std::clamp(0.5f + 0.5f * normal.dot(up), 0.0f, 1.0f);
    }
    return cover;
  });
}

void Painter::paint_limb(ImagePlanes& image, const Limb& limb, const Rows& rows) const {
  const auto a_px = lens_.project(limb.a_m.cast<double>());
  const auto b_px = lens_.project(limb.b_m.cast<double>());
  if (!a_px || !b_px) return;
  const auto focal_px = static_cast<float>(0.5 * (lens_.intrinsics().fx_px + lens_.intrinsics().fy_px));
  const Vector2f a = a_px->cast<float>(), ab = b_px->cast<float>() - a;
  const float radius_a = focal_px * limb.radius_a_m / limb.a_m.z();
  const float radius_b = focal_px * limb.radius_b_m / limb.b_m.z();
  const float reach = std::max(radius_a, radius_b) + edge_width_px_;
  const float scale = 1.0f / std::max(ab.squaredNorm(), 1e-6f);
  const Box box =
      clipped(image, rows, std::min(a.x(), a.x() + ab.x()) - reach, std::min(a.y(), a.y() + ab.y()) - reach,
              std::max(a.x(), a.x() + ab.x()) + reach, std::max(a.y(), a.y() + ab.y()) + reach);
  blend_box(image, box, limb.colour, [&](int x, int y) {
    const Vector2f p(static_cast<float>(x) - a.x(), static_cast<float>(y) - a.y());
    const float along = std::clamp(p.dot(ab) * scale, 0.0f, 1.0f);
    const float radius = radius_a + along * (radius_b - radius_a);
    const float distance2 = (p - along * ab).squaredNorm();
    const float outer = radius + 0.5f * edge_width_px_;
    if (distance2 >= outer * outer) return Cover{};
    const float distance = std::sqrt(distance2);
    const float bulge = std::sqrt(std::max(0.0f, 1.0f - distance2 / (radius * radius)));
    return Cover{smooth_step(0.5f + (radius - distance) / edge_width_px_), limb_shadow + limb_light * bulge};
  });
}

}  // namespace handloft::tracking
