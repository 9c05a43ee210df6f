#include "daemon-tracking/calibration/simulated_board.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "daemon-tracking/source/simulated/image_planes.h"
#include "daemon-tracking/source/simulated/lens.h"
#include "daemon-tracking/source/simulated/random.h"

namespace handloft::tracking {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr float room = 90, paper = 215, black = 35;
constexpr std::uint64_t noise_stream = 0xB0A4D;
/// All cameras of the rig see a pose's frames within a few milliseconds of each other.
constexpr Duration stagger = std::chrono::milliseconds(5);

class BoardStream final : public SampleStream {
 public:
  BoardStream(Rig rig, std::vector<std::uint32_t> cameras, std::vector<Isometry3d> poses,
              const SimulatedBoardOptions& options)
      : rig_(std::move(rig)),
        cameras_(std::move(cameras)),
        poses_(std::move(poses)),
        options_(options),
        noise_(options.noise_luma, 0.0),
        encoder_(options.jpeg_quality) {
    for (const std::uint32_t camera : cameras_)
      rays_.push_back(rays_of(Lens(rig_.cameras[camera].intrinsics)));
  }

  std::optional<Sample> next() override {
    if (cameras_.empty()) return std::nullopt;
    const std::size_t camera = step_ % cameras_.size(), frame = step_ / cameras_.size();
    const std::size_t pose = frame / static_cast<std::size_t>(options_.frames_per_pose);
    if (pose >= poses_.size()) return std::nullopt;
    ++step_;
    const CameraCalibration& calibration = rig_.cameras[cameras_[camera]];
    ImagePlanes image(calibration.intrinsics.width_px, calibration.intrinsics.height_px);
    std::fill(image.cb.begin(), image.cb.end(), std::uint8_t{128});
    std::fill(image.cr.begin(), image.cr.end(), std::uint8_t{128});
    draw(image, rays_[camera], calibration.world_from_camera.inverse() * poses_[pose]);
    noise_.add(image, hash_bits(1, noise_stream + camera, frame));
    Result<std::vector<std::uint8_t>> jpeg = encoder_.encode(image);
    if (!jpeg) return std::nullopt;
    CameraFrame out;
    out.camera = cameras_[camera];
    out.sequence = frame;
    out.capture_time = from_ns(1'000'000'000) +
                       from_seconds(static_cast<double>(frame) / options_.frames_per_s) +
                       static_cast<int>(camera) * stagger;
    out.arrival_time = out.capture_time + stagger;
    out.width_px = image.width;
    out.height_px = image.height;
    out.bytes = std::make_shared<const std::vector<std::uint8_t>>(std::move(*jpeg));
    return out;
  }

 private:
  static std::vector<Vector2d> rays_of(const Lens& lens) {
    std::vector<Vector2d> rays;
    for (int y = 0; y < lens.intrinsics().height_px; ++y)
      for (int x = 0; x < lens.intrinsics().width_px; ++x) rays.push_back(lens.ray({x, y}));
    return rays;
  }

  /// Luma of the board's plane; negative beside the sheet.
  float luma_at(double x_m, double y_m) const {
    const ChessboardShape& shape = options_.shape;
    const double u = x_m / shape.square_m + 0.5 * (shape.columns + 1),
                 v = 0.5 * (shape.rows + 1) - y_m / shape.square_m;
    constexpr double rim = 0.6;
    if (u < -rim || v < -rim || u > shape.columns + 1 + rim || v > shape.rows + 1 + rim) return -1;
    const double column = std::floor(u), row = std::floor(v);
    if (column < 0 || row < 0 || column > shape.columns || row > shape.rows) return paper;
    // The inner square at the first corner (1, 1) is dark.
    return (static_cast<int>(column) + static_cast<int>(row)) % 2 == 0 ? black : paper;
  }

  void draw(ImagePlanes& image, const std::vector<Vector2d>& rays,
            const Isometry3d& camera_from_board) const {
    const Eigen::Matrix3d axes = camera_from_board.linear();
    const Vector3d centre = camera_from_board.translation(), normal = axes.col(2);
    const double plane = normal.dot(centre);
    const bool face = plane < 0;  // Its printed side is turned to the camera.
    const int width = image.width, height = image.height;
    const auto ray_at = [&](int x, int y) {
      return rays[static_cast<std::size_t>(std::clamp(y, 0, height - 1)) * static_cast<std::size_t>(width) +
                  static_cast<std::size_t>(std::clamp(x, 0, width - 1))];
    };
    const auto luma_of = [&](const Vector2d& ray) -> float {
      const Vector3d direction(ray.x(), ray.y(), 1.0);
      const double slope = normal.dot(direction);
      if (!face || slope > -1e-6) return room;
      const Vector3d local = axes.transpose() * (direction * (plane / slope) - centre);
      const float luma = luma_at(local.x(), local.y());
      return luma < 0 ? room : luma;
    };
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        const Vector2d ray = ray_at(x, y);
        const Vector2d dx = (ray_at(x + 1, y) - ray_at(x - 1, y)) / 2,
                       dy = (ray_at(x, y + 1) - ray_at(x, y - 1)) / 2;
        // Where the corners of the pixel's surroundings agree, so does all between.
        const float a = luma_of(ray - dx - dy), b = luma_of(ray + dx - dy), c = luma_of(ray - dx + dy),
                    d = luma_of(ray + dx + dy);
        float luma = a;
        if (!(a == b && b == c && c == d && luma_of(ray) == a)) {
          float sum = 0;
          for (int j = 0; j < options_.rays; ++j)
            for (int i = 0; i < options_.rays; ++i)
              sum += luma_of(ray + ((i + 0.5) / options_.rays - 0.5) * options_.spread * dx +
                             ((j + 0.5) / options_.rays - 0.5) * options_.spread * dy);
          luma = sum / static_cast<float>(options_.rays * options_.rays);
        }
        image.y[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)] =
            static_cast<std::uint8_t>(std::lround(luma));
      }
    }
  }

  Rig rig_;
  std::vector<std::uint32_t> cameras_;
  std::vector<Isometry3d> poses_;
  SimulatedBoardOptions options_;
  SensorNoise noise_;
  JpegEncoder encoder_;
  std::vector<std::vector<Vector2d>> rays_;
  std::size_t step_ = 0;
};

}  // namespace

std::vector<Isometry3d> waved_before(const CameraCalibration& camera, const ChessboardShape& shape,
                                     int poses) {
  std::vector<Isometry3d> made;
  const CameraIntrinsics& lens = camera.intrinsics;
  // So far away that the board fills about half of the picture's height, nearer and farther in turn, and so
  // far aside that it just stays within.
  const double width_m = shape.square_m * (shape.columns + 1), height_m = shape.square_m * (shape.rows + 1);
  for (int i = 0; i < poses; ++i) {
    const double distance = height_m * lens.fy_px / lens.height_px *
                            (i % 3 == 0   ? 1.9
                             : i % 3 == 1 ? 2.4
                                          : 1.6);
    constexpr double used = 0.45;
    const double across = used * std::max(0.0, lens.width_px / lens.fx_px * distance - width_m);
    const double along = used * std::max(0.0, lens.height_px / lens.fy_px * distance - height_m);
    Isometry3d board = Isometry3d::Identity();
    board.translation() = Vector3d(across * std::sin(2.4 * i), along * std::sin(1.7 * i + 1), distance);
    const double tilt = 0.5;
    // Face to the camera: turned half about x, then tilted.
    board.linear() = (Eigen::AngleAxisd(tilt * std::sin(1.9 * i + 0.4), Vector3d::UnitX()) *
                      Eigen::AngleAxisd(tilt * std::cos(2.3 * i), Vector3d::UnitY()) *
                      Eigen::AngleAxisd(0.2 * std::sin(3.1 * i), Vector3d::UnitZ()) *
                      Eigen::AngleAxisd(M_PI, Vector3d::UnitX()))
                         .toRotationMatrix();
    made.push_back(camera.world_from_camera * board);
  }
  return made;
}

std::vector<Isometry3d> waved_over_table(const Rig& rig, int poses) {
  Vector3d eye = Vector3d::Zero();
  int count = 0;
  for (const CameraCalibration& camera : rig.cameras) {
    if (camera.role != CameraRole::table) continue;
    eye += camera.world_from_camera.translation();
    ++count;
  }
  eye /= std::max(1, count);
  std::vector<Isometry3d> made;
  for (int i = 0; i < poses; ++i) {
    Isometry3d board = Isometry3d::Identity();
    board.translation() = Vector3d(0.05 + 0.07 * std::sin(2.1 * i), 0.06 * std::cos(1.3 * i),
                                   0.17 + 0.05 * std::sin(1.7 * i + 0.5));
    const Vector3d normal = (eye - board.translation()).normalized();
    const Vector3d right = Vector3d::UnitZ().cross(normal).normalized();
    Eigen::Matrix3d facing;
    facing << right, normal.cross(right), normal;
    board.linear() = (Eigen::AngleAxisd(0.25 * std::sin(1.1 * i), right) *
                      Eigen::AngleAxisd(0.2 * std::cos(2.9 * i), Vector3d::UnitZ()))
                         .toRotationMatrix() *
                     facing;
    made.push_back(board);
  }
  return made;
}

std::unique_ptr<SampleStream> simulated_board_stream(Rig rig, std::vector<std::uint32_t> cameras,
                                                     std::vector<Isometry3d> poses,
                                                     const SimulatedBoardOptions& options) {
  return std::make_unique<BoardStream>(std::move(rig), std::move(cameras), std::move(poses), options);
}

}  // namespace handloft::tracking
