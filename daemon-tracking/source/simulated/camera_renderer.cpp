#include "daemon-tracking/source/simulated/camera_renderer.h"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace handloft::tracking {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::Vector3f;

/// Texels of the head camera's picture of the table: a little finer than its pixels from half a metre.
constexpr double texel_m = 0.0008;
/// Rays per pixel and axis where tags are seen.
constexpr int background_rays = 5;
constexpr int head_tag_rays = 3;
/// Rows that a rolling shutter is taken to expose at once: 0.2 ms of a webcam's.
constexpr int shutter_band_rows = 4;
/// The warp is exact at every so many pixels and linear between: off by less than 0.01 texels.
constexpr int warp_step = 4;
constexpr int fixed_bits = 16;
/// A ball that moves less than this in an exposure is drawn once, metres.
constexpr double still_m = 0.0003;

// The glove, thin towards the caps so that it hides little of them; sleeve; the display on the head. Metres.
constexpr PaintColour glove{62, 128, 128}, sleeve{92, 131, 126}, display_body{40, 128, 128};
constexpr float knuckle_radius_m = 0.0085f, joint_radius_m = 0.0070f, stem_radius_m = 0.0042f;
constexpr float metacarpal_radius_m = 0.0125f, wrist_radius_m = 0.024f, elbow_radius_m = 0.036f;
constexpr double stem_gap_m = 0.0118;  ///< From a cap's centre back to where the finger's end is round.
const Vector3d wrist_in_palm(0.0, -0.045, 0.0);
const Vector3d shoulder_world(0.16, -0.62, 0.22);
constexpr double forearm_m = 0.26;
const Vector3d head_centre(0.0, 0.03, 0.055);
constexpr float head_radius_m = 0.088f;

}  // namespace

CameraRenderer::CameraRenderer(const Rig& rig, std::size_t camera, const ImageOptions& options)
    : rig_(rig),
      camera_(rig.cameras.at(camera)),
      options_(options),
      painter_(camera_.intrinsics, options.blur_px),
      noise_(options.noise_luma, options.noise_chroma),
      encoder_(options.jpeg_quality),
      scene_(rig.table_tags),
      image_(camera_.intrinsics.width_px, camera_.intrinsics.height_px) {
  if (camera_.role == CameraRole::table) {
    for (const TagPlacement& placement : rig.head_tags) {
      if (const auto bitmap = tag_bitmap(placement.id)) head_tags_.push_back({placement, *bitmap});
    }
    draw_background();
  } else {
    texture_ = scene_.texture(texel_m);
  }
}

Isometry3d CameraRenderer::world_from_camera(const Isometry3d& world_from_head) const {
  return camera_.role == CameraRole::table ? camera_.world_from_camera
                                           : world_from_head * camera_.head_from_camera;
}

Result<std::vector<std::uint8_t>> CameraRenderer::render(const ExposureAfter& exposure,
                                                         std::uint64_t noise_key) {
  return encoder_.encode(draw(exposure, noise_key));
}

Result<std::vector<std::uint8_t>> CameraRenderer::render(const Exposure& exposure, std::uint64_t noise_key) {
  return encoder_.encode(draw(exposure, noise_key));
}

const ImagePlanes& CameraRenderer::draw(const Exposure& exposure, std::uint64_t noise_key) {
  return draw([&](double) { return exposure; }, noise_key);
}

const ImagePlanes& CameraRenderer::draw(const ExposureAfter& exposure, std::uint64_t noise_key) {
  if (camera_.role == CameraRole::table) image_ = background_;
  const int band = options_.row_time_s > 0.0 ? shutter_band_rows : image_.height;
  for (int begin = 0; begin < image_.height; begin += band) {
    const Rows rows{begin, std::min(begin + band, image_.height)};
    const double middle = 0.5 * (rows.begin + rows.end - 1) - 0.5 * (image_.height - 1);
    draw_rows(exposure(middle * options_.row_time_s), rows);
  }
  if (options_.brightness != 1.0) scale_brightness();
  noise_.add(image_, noise_key);
  return image_;
}

void CameraRenderer::draw_rows(const Exposure& exposure, const Rows& rows) {
  const Isometry3d world_from_eye = world_from_camera(exposure.world_from_head);
  const Isometry3d camera_from_world = world_from_eye.inverse();
  if (camera_.role == CameraRole::table) {
    draw_head(camera_from_world * exposure.world_from_head, rows);
  } else {
    warp_table(world_from_eye, rows);
  }
  if (exposure.middle.present) draw_hand(exposure, camera_from_world, rows);
}

void CameraRenderer::draw_background() {
  background_ = ImagePlanes(image_.width, image_.height);
  const Vector3d eye = camera_.world_from_camera.translation();
  const Eigen::Matrix3d axes = camera_.world_from_camera.linear();
  const Lens& optics = painter_.lens();
  // Where a pixel's ray meets the table; nullopt when it goes up.
  const auto table_point = [&](const Vector2d& ray) -> std::optional<Vector2d> {
    const Vector3d direction = axes * Vector3d(ray.x(), ray.y(), 1.0);
    if (direction.z() > -1e-3) return std::nullopt;
    return Vector2d((eye - direction * (eye.z() / direction.z())).head<2>());
  };
  for (int y = 0; y < image_.height; ++y) {
    for (int x = 0; x < image_.width; ++x) {
      const std::size_t index =
          static_cast<std::size_t>(y) * static_cast<std::size_t>(image_.width) + static_cast<std::size_t>(x);
      const Vector2d centre = painter_.rays()[index].cast<double>();
      const auto middle = table_point(centre);
      float luma = scene_light::room_y;
      bool board = false;
      if (middle) {
        board = scene_.on_board(middle->x(), middle->y());
        constexpr double pixel_reach_m = 0.004;
        const int rays = scene_.near_tag(middle->x(), middle->y(), pixel_reach_m) ? background_rays : 1;
        float sum = 0;
        for (int j = 0; j < rays; ++j) {
          for (int i = 0; i < rays; ++i) {
            const Vector2d pixel(x + (i + 0.5) / rays - 0.5, y + (j + 0.5) / rays - 0.5);
            const auto hit = rays == 1 ? middle : table_point(optics.ray(pixel));
            sum += hit ? scene_.luma_at(hit->x(), hit->y()) : scene_light::room_y;
          }
        }
        luma = sum / static_cast<float>(rays * rays);
      }
      background_.y[index] = static_cast<std::uint8_t>(std::lround(luma));
      if (x % 2 == 0) {
        background_.cb[index / 2] =
            static_cast<std::uint8_t>(board ? scene_light::board_cb : scene_light::room_cb);
        background_.cr[index / 2] =
            static_cast<std::uint8_t>(board ? scene_light::board_cr : scene_light::room_cr);
      }
    }
  }
  blur_background();
}

void CameraRenderer::blur_background() {
  // Three taps a, 1 - 2a, a have the variance 2a, once along each axis.
  const float a = std::min(0.25f, static_cast<float>(options_.blur_px * options_.blur_px / 2));
  const int width = image_.width, height = image_.height;
  std::vector<float> across(background_.y.size());
  const auto at = [&](int x, int y) {
    return static_cast<std::size_t>(std::clamp(y, 0, height - 1)) * static_cast<std::size_t>(width) +
           static_cast<std::size_t>(std::clamp(x, 0, width - 1));
  };
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      across[at(x, y)] = (1 - 2 * a) * background_.y[at(x, y)] +
                         a * static_cast<float>(background_.y[at(x - 1, y)] + background_.y[at(x + 1, y)]);
    }
  }
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const float value = (1 - 2 * a) * across[at(x, y)] + a * (across[at(x, y - 1)] + across[at(x, y + 1)]);
      background_.y[at(x, y)] = static_cast<std::uint8_t>(std::lround(value));
    }
  }
}

void CameraRenderer::warp_table(const Isometry3d& world_from_eye, const Rows& rows) {
  // texel (u, v, 1) * w = H * (ray x, ray y, 1): the table's plane z = 0 seen along the ray.
  const Vector3d eye = world_from_eye.translation();
  const Eigen::Matrix3d axes = world_from_eye.linear();
  Eigen::Matrix3d homography;
  homography.row(0) = (axes.row(2) * (eye.x() - texture_.left_m) - eye.z() * axes.row(0)) / texture_.texel_m;
  homography.row(1) = (axes.row(2) * (texture_.top_m - eye.y()) + eye.z() * axes.row(1)) / texture_.texel_m;
  homography.row(2) = axes.row(2);
  const Eigen::Matrix3f h = homography.cast<float>();
  const float max_u = static_cast<float>(texture_.width - 2), max_v = static_cast<float>(texture_.height - 2);
  const auto room = static_cast<std::uint8_t>(scene_light::room_y);
  const auto width = static_cast<std::size_t>(image_.width);
  const auto first_row = static_cast<std::size_t>(rows.begin), end_row = static_cast<std::size_t>(rows.end);
  const std::size_t chroma_begin = first_row * width / 2, chroma_size = (end_row - first_row) * width / 2;
  std::memset(image_.cb.data() + chroma_begin, static_cast<int>(scene_light::board_cb), chroma_size);
  std::memset(image_.cr.data() + chroma_begin, static_cast<int>(scene_light::board_cr), chroma_size);
  const auto texture_width = static_cast<std::size_t>(texture_.width);
  struct Place {
    float u, v;
    bool inside;
  };
  const auto place_of = [&](std::size_t index) -> Place {
    const Eigen::Vector2f& ray = painter_.rays()[index];
    const float w = h(2, 0) * ray.x() + h(2, 1) * ray.y() + h(2, 2);
    if (!(w < -1e-3f)) return {0, 0, false};  // Looking up.
    const float u = (h(0, 0) * ray.x() + h(0, 1) * ray.y() + h(0, 2)) / w;
    const float v = (h(1, 0) * ray.x() + h(1, 1) * ray.y() + h(1, 2)) / w;
    // Beside the board the texture's margin, which shows the room, goes on.
    return {std::clamp(u, 0.0f, max_u), std::clamp(v, 0.0f, max_v), u > 0 && v > 0 && u < max_u && v < max_v};
  };
  constexpr float one = 1 << fixed_bits;
  for (std::size_t y = first_row; y < end_row; ++y) {
    std::uint8_t* row = image_.y.data() + y * width;
    Place from = place_of(y * width);
    for (std::size_t x = 0; x < width; x += warp_step) {
      const std::size_t last = std::min(x + warp_step, width - 1);
      const Place to = place_of(y * width + last);
      if (!from.inside && !to.inside) {
        std::memset(row + x, room, std::min<std::size_t>(warp_step, width - x));
        for (std::size_t c = x / 2; c < std::min(x + warp_step, width) / 2; ++c) {
          image_.cb[y * width / 2 + c] = static_cast<std::uint8_t>(scene_light::room_cb);
          image_.cr[y * width / 2 + c] = static_cast<std::uint8_t>(scene_light::room_cr);
        }
      } else {
        const std::size_t span = std::max<std::size_t>(1, last - x);
        const float share = one / static_cast<float>(span);
        const auto step_u = static_cast<std::int32_t>((to.u - from.u) * share);
        const auto step_v = static_cast<std::int32_t>((to.v - from.v) * share);
        auto u = static_cast<std::int32_t>(from.u * one), v = static_cast<std::int32_t>(from.v * one);
        const std::size_t end = std::min(x + warp_step, width);
        for (std::size_t i = x; i < end; ++i, u += step_u, v += step_v) {
          // Rounding of the step may pass the texture's edge by a fraction.
          const auto tu = std::min<std::size_t>(static_cast<std::size_t>(std::max(u, 0) >> fixed_bits),
                                                texture_width - 2);
          const auto tv = std::min<std::size_t>(static_cast<std::size_t>(std::max(v, 0) >> fixed_bits),
                                                static_cast<std::size_t>(texture_.height) - 2);
          const int fu = (u >> (fixed_bits - 8)) & 255, fv = (v >> (fixed_bits - 8)) & 255;
          const std::uint8_t* texel = texture_.luma.data() + tv * texture_width + tu;
          const int above = texel[0] * (256 - fu) + texel[1] * fu;
          const int below = texel[texture_width] * (256 - fu) + texel[texture_width + 1] * fu;
          row[i] = static_cast<std::uint8_t>((above * (256 - fv) + below * fv + (1 << 15)) >> 16);
        }
      }
      from = to;
    }
  }
}

void CameraRenderer::draw_head(const Isometry3d& camera_from_head, const Rows& rows) {
  Ball head;
  head.centres_m = {(camera_from_head * head_centre).cast<float>()};
  head.radius_m = head_radius_m;
  head.colour = display_body;
  const Vector3f up = (camera_.world_from_camera.linear().transpose() * Vector3d::UnitZ()).cast<float>();
  painter_.add(std::move(head));
  painter_.paint(image_, up, rows);
  for (const HeadTag& tag : head_tags_) draw_tag(tag, camera_from_head, rows);
}

void CameraRenderer::draw_tag(const HeadTag& tag, const Isometry3d& camera_from_head, const Rows& rows) {
  const Isometry3d camera_from_tag = camera_from_head * tag.placement.body_from_tag;
  const Vector3d normal = camera_from_tag.linear().col(2), centre = camera_from_tag.translation();
  if (normal.dot(centre) >= 0) return;  // Its back.
  const double sheet = TagBitmap::sheet_edge_m(tag.placement.edge_m) / 2;
  double low_x = 1e9, low_y = 1e9, high_x = -1e9, high_y = -1e9;
  for (const Vector2d& corner :
       {Vector2d(-sheet, -sheet), Vector2d(sheet, -sheet), Vector2d(sheet, sheet), Vector2d(-sheet, sheet)}) {
    const auto pixel = painter_.lens().project(camera_from_tag * Vector3d(corner.x(), corner.y(), 0));
    if (!pixel) return;
    low_x = std::min(low_x, pixel->x());
    low_y = std::min(low_y, pixel->y());
    high_x = std::max(high_x, pixel->x());
    high_y = std::max(high_y, pixel->y());
  }
  const int x0 = std::max(1, static_cast<int>(low_x) - 1),
            x1 = std::min(image_.width - 2, static_cast<int>(high_x) + 1);
  const int y0 = std::max({1, rows.begin, static_cast<int>(low_y) - 1}),
            y1 = std::min({image_.height - 2, rows.end - 1, static_cast<int>(high_y) + 1});
  const Eigen::Matrix3d axes = camera_from_tag.linear();
  const double plane = normal.dot(centre);
  const auto width = static_cast<std::size_t>(image_.width);
  // Blur: the rays of a pixel are spread over more than its area, with the lens's variance added.
  const double spread = std::sqrt(1.0 + 12.0 * options_.blur_px * options_.blur_px);
  for (int y = y0; y <= y1; ++y) {
    for (int x = x0; x <= x1; ++x) {
      const std::size_t index = static_cast<std::size_t>(y) * width + static_cast<std::size_t>(x);
      // Rays between pixels: linear from those of the neighbours.
      const Vector2d ray = painter_.rays()[index].cast<double>();
      const Vector2d dx = (painter_.rays()[index + 1] - painter_.rays()[index - 1]).cast<double>() / 2;
      const Vector2d dy =
          (painter_.rays()[index + width] - painter_.rays()[index - width]).cast<double>() / 2;
      double sum = 0, hits = 0;
      for (int j = 0; j < head_tag_rays; ++j) {
        for (int i = 0; i < head_tag_rays; ++i) {
          const Vector2d at = ray + ((i + 0.5) / head_tag_rays - 0.5) * spread * dx +
                              ((j + 0.5) / head_tag_rays - 0.5) * spread * dy;
          const Vector3d direction(at.x(), at.y(), 1.0);
          const Vector3d local = axes.transpose() * (direction * (plane / normal.dot(direction)) - centre);
          if (const auto white = tag.bitmap.white_at(local.x(), local.y(), tag.placement.edge_m)) {
            sum += *white ? scene_light::tag_white : scene_light::tag_black;
            hits += 1;
          }
        }
      }
      if (hits <= 0) continue;
      constexpr double all = head_tag_rays * head_tag_rays;
      const double value = (sum + (all - hits) * image_.y[index]) / all;
      image_.y[index] = static_cast<std::uint8_t>(std::lround(value));
      if (x % 2 == 0) image_.cb[index / 2] = image_.cr[index / 2] = 128;
    }
  }
}

void CameraRenderer::draw_hand(const Exposure& exposure, const Isometry3d& camera_from_world,
                               const Rows& rows) {
  const auto seen = [&](const Vector3d& world) -> Vector3f {
    return (camera_from_world * world).cast<float>();
  };
  const HandState& hand = exposure.middle;
  const Vector3d wrist = hand.world_from_palm * wrist_in_palm;
  const Vector3d elbow = wrist + forearm_m * (shoulder_world - wrist).normalized();
  painter_.add(Limb{seen(wrist), seen(elbow), wrist_radius_m, elbow_radius_m, sleeve});
  for (std::size_t i = 0; i < finger_count; ++i) {
    const Vector3d &tip = hand.fingertips_m[i], &joint = hand.middle_joints_m[i],
                   &knuckle = hand.knuckles_m[i];
    const Vector3d way = tip - joint;
    const double length = std::max(way.norm(), 1e-6);
    const Vector3d stem = joint + way * std::max(0.0, 1.0 - stem_gap_m / length);
    painter_.add(Limb{seen(wrist), seen(knuckle), wrist_radius_m * 0.8f, metacarpal_radius_m, glove});
    painter_.add(Limb{seen(knuckle), seen(joint), knuckle_radius_m, joint_radius_m, glove});
    painter_.add(Limb{seen(joint), seen(stem), joint_radius_m, stem_radius_m, glove});
    Ball cap;
    const bool still = (exposure.end.fingertips_m[i] - exposure.begin.fingertips_m[i]).norm() < still_m;
    cap.centres_m = still ? std::vector<Vector3f>{seen(tip)}
                          : std::vector<Vector3f>{seen(exposure.begin.fingertips_m[i]), seen(tip),
                                                  seen(exposure.end.fingertips_m[i])};
    cap.radius_m = static_cast<float>(rig_.fingertip_radius_m);
    const FingertipColour& colour = rig_.colours[i];
    cap.colour = {static_cast<float>(colour.y), static_cast<float>(colour.cb), static_cast<float>(colour.cr)};
    painter_.add(std::move(cap));
  }
  painter_.paint(image_, (camera_from_world.linear() * Vector3d::UnitZ()).cast<float>(), rows);
}

void CameraRenderer::scale_brightness() {
  const auto factor = static_cast<float>(options_.brightness);
  const auto scale = [](std::uint8_t value, float by, float about) {
    const float scaled = about + (static_cast<float>(value) - about) * by;
    return static_cast<std::uint8_t>(std::clamp(scaled + 0.5f, 0.0f, 255.0f));
  };
  for (std::uint8_t& value : image_.y) value = scale(value, factor, 0.0f);
  for (std::uint8_t& value : image_.cb) value = scale(value, factor, 128.0f);
  for (std::uint8_t& value : image_.cr) value = scale(value, factor, 128.0f);
}

}  // namespace handloft::tracking
