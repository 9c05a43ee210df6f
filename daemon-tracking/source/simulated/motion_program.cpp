#include "daemon-tracking/source/simulated/motion_program.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <memory>
#include <string>
#include <string_view>

#include "daemon-tracking/source/simulated/hand_model.h"

namespace handloft::tracking {
namespace {

using Eigen::Vector3d;

constexpr std::array<std::string_view, finger_count> columns{"thumb_tip X", "index_tip X", "middle_tip X",
                                                             "ring_tip X", "little_tip X"};
constexpr std::size_t max_line_bytes = 1 << 16;
constexpr std::size_t max_frames = 10'000'000;
constexpr double fastest_rate_hz = 10'000.0;
constexpr double idle_s = 0.8;
/// From the hand model's own shape to the recorded one, and back at the end.
constexpr double shape_blend_s = 0.5;

std::vector<std::string_view> split(std::string_view line) {
  std::vector<std::string_view> out;
  while (!line.empty() && (line.back() == '\r' || line.back() == '\n')) line.remove_suffix(1);
  for (;;) {
    const std::size_t tab = line.find('\t');
    out.push_back(line.substr(0, tab));
    if (tab == std::string_view::npos) return out;
    line.remove_prefix(tab + 1);
  }
}

std::optional<double> number(const std::vector<std::string_view>& row, std::size_t column) {
  if (column >= row.size()) return std::nullopt;
  double value = 0;
  const auto [end, error] =
      std::from_chars(row[column].data(), row[column].data() + row[column].size(), value);
  if (error != std::errc() || end != row[column].data() + row[column].size() || !std::isfinite(value)) {
    return std::nullopt;
  }
  return value;
}

std::optional<Vector3d> place(const std::vector<std::string_view>& row, std::size_t column) {
  const auto x = number(row, column), y = number(row, column + 1), z = number(row, column + 2);
  constexpr double farthest_mm = 1e5;
  if (!x || !y || !z) return std::nullopt;
  const Vector3d mm(*x, *y, *z);
  if (mm.isZero(1e-6) || mm.norm() > farthest_mm) return std::nullopt;
  return mm * 1e-3;
}

/// Straight over the gaps; nullopt when a finger is hidden from the first or to the last frame.
std::optional<FingerPoints> bridged(const HandMotion& motion, std::size_t frame) {
  FingerPoints tips;
  for (std::size_t f = 0; f < finger_count; ++f) {
    std::size_t before = frame, after = frame;
    while (!motion.frames[before][f] && before > 0) --before;
    while (!motion.frames[after][f] && after + 1 < motion.frames.size()) ++after;
    if (!motion.frames[before][f] || !motion.frames[after][f]) return std::nullopt;
    const double share =
        after > before ? static_cast<double>(frame - before) / static_cast<double>(after - before) : 0;
    tips[f] = (1 - share) * *motion.frames[before][f] + share * *motion.frames[after][f];
  }
  return tips;
}

/// Where the hand was, in our room, frame by frame.
struct Placed {
  double rate_hz = 100.0;
  std::vector<FingerPoints> tips;
  double low_m = 0, high_m = 0;  ///< Heights of the mean where the pressure is 1 and 0.

  double duration_s() const { return static_cast<double>(tips.size() - 1) / rate_hz; }

  FingerPoints at(double u) const {
    const double frame = std::clamp(u, 0.0, 1.0) * static_cast<double>(tips.size() - 1);
    const std::size_t i = std::min(static_cast<std::size_t>(frame), tips.size() - 2);
    const double share = frame - static_cast<double>(i);
    FingerPoints out;
    for (std::size_t f = 0; f < finger_count; ++f) out[f] = (1 - share) * tips[i][f] + share * tips[i + 1][f];
    return out;
  }
};

double smooth(double x) {
  const double t = std::clamp(x, 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

/// The recorded fingertips, but near both ends the model's own open hand about the same mean.
FingerPoints with_blended_ends(const Placed& placed, double u) {
  FingerPoints tips = placed.at(u);
  const double weight = smooth(std::min(u, 1 - u) * placed.duration_s() / shape_blend_s);
  if (weight >= 1) return tips;
  const FingerPoints open = hand_shape(HandPose::open).fingertips_m;
  const Vector3d middle = centroid(tips), open_middle = centroid(open);
  for (std::size_t f = 0; f < finger_count; ++f) {
    tips[f] = weight * tips[f] + (1 - weight) * (middle + open[f] - open_middle);
  }
  return tips;
}

}  // namespace

Result<HandMotion> read_hand_motion(const std::filesystem::path& path) {
  std::ifstream file(path);
  if (!file) return make_error(ErrorCode::io, fmt::format("cannot read {}", path.string()));
  HandMotion motion;
  std::array<std::size_t, finger_count> first_column{};
  bool in_table = false;
  for (std::string line; std::getline(file, line);) {
    if (line.size() > max_line_bytes) {
      return make_error(ErrorCode::resource_exhausted, fmt::format("{}: a line is too long", path.string()));
    }
    const auto row = split(line);
    if (in_table) {
      if (motion.frames.size() >= max_frames) {
        return make_error(ErrorCode::resource_exhausted, fmt::format("{}: too many frames", path.string()));
      }
      auto& frame = motion.frames.emplace_back();
      for (std::size_t f = 0; f < finger_count; ++f) frame[f] = place(row, first_column[f]);
    } else if (row[0] == "FREQUENCY") {
      motion.rate_hz = number(row, 1).value_or(0.0);
      if (!(motion.rate_hz >= 1.0 && motion.rate_hz <= fastest_rate_hz)) {
        return make_error(ErrorCode::data_corrupt,
                          fmt::format("{}: expected a frequency of 1..{}", path.string(), fastest_rate_hz),
                          "FREQUENCY");
      }
    } else if (row[0] == "Frame") {
      for (std::size_t f = 0; f < finger_count; ++f) {
        const auto found = std::find(row.begin(), row.end(), columns[f]);
        if (found == row.end()) {
          return make_error(ErrorCode::data_corrupt,
                            fmt::format("{}: no column \"{}\"", path.string(), columns[f]), "Frame");
        }
        first_column[f] = static_cast<std::size_t>(found - row.begin());
      }
      in_table = true;
    }
  }
  if (motion.frames.empty()) {
    return make_error(ErrorCode::data_corrupt, fmt::format("{}: no frames of a hand", path.string()));
  }
  return motion;
}

Result<HandProgram> motion_program(const HandMotion& motion, const MotionProgramOptions& options) {
  const auto refuse = [](const char* field, std::string message) {
    return make_error(ErrorCode::invalid_argument, std::move(message), field);
  };
  if (!(options.begin_s >= 0.0) || !(options.longest_s > 0.0))
    return refuse("begin_s", "expected times of 0 s and more");
  if (motion.frames.size() > options.max_frames) {
    return make_error(
        ErrorCode::resource_exhausted,
        fmt::format("found {} frames, expected at most {}", motion.frames.size(), options.max_frames),
        "frames");
  }
  auto placed = std::make_shared<Placed>();
  placed->rate_hz = motion.rate_hz;
  const double first = options.begin_s * motion.rate_hz, wanted = options.longest_s * motion.rate_hz;
  for (std::size_t i = 0; i < motion.frames.size(); ++i) {
    if (static_cast<double>(i) < first || static_cast<double>(placed->tips.size()) > wanted) continue;
    if (auto tips = bridged(motion, i)) placed->tips.push_back(*tips);
  }
  if (placed->tips.size() < 2) return refuse("frames", "found fewer than two frames with five fingertips");

  Vector3d low = Vector3d::Constant(INFINITY), high = Vector3d::Constant(-INFINITY);
  for (FingerPoints& tips : placed->tips) {
    for (Vector3d& tip : tips) {
      tip = Vector3d(-tip.y(), tip.x(), tip.z());
      low = low.cwiseMin(tip);
      high = high.cwiseMax(tip);
    }
  }
  const Vector3d shift(options.centre_m.x() - (low.x() + high.x()) / 2,
                       options.centre_m.y() - (low.y() + high.y()) / 2, options.lowest_m - low.z());
  std::vector<double> heights;
  heights.reserve(placed->tips.size());
  for (FingerPoints& tips : placed->tips) {
    for (Vector3d& tip : tips) tip += shift;
    heights.push_back(centroid(tips).z());
  }
  std::sort(heights.begin(), heights.end());
  placed->low_m = heights.front();
  placed->high_m = heights[static_cast<std::size_t>(std::clamp(options.hover_share, 0.0, 1.0) *
                                                    static_cast<double>(heights.size() - 1))];

  HandProgram program(options.hand);
  program.idle(idle_s);
  program.follow_fingertips(
      "recorded hand", [placed](double u) { return with_blended_ends(*placed, u); }, placed->duration_s(),
      [placed](double u) {
        const double height = centroid(placed->at(u)).z();
        const double reach = placed->high_m - placed->low_m;
        return reach > 0 ? std::clamp((placed->high_m - height) / reach, 0.0, 1.0) : 0.0;
      });
  program.idle(idle_s);
  return program;
}

}  // namespace handloft::tracking
