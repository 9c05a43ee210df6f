#include "daemon-tracking/source/calibration_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <fstream>
#include <set>

namespace handloft::tracking {
namespace {

/// Ranges of what may stand in a file: wide enough for any desk, narrow enough that nothing overflows.
constexpr int max_side_px = 8192;
constexpr double max_focal_px = 1e5, max_distortion = 100.0, max_place_m = 100.0, max_edge_m = 2.0;
constexpr double max_frames_per_s = 1000.0;
constexpr double max_radius_m = 0.1;
constexpr double max_sigma = 255.0;
constexpr double max_residual = 1e6;
constexpr Duration longest_offset = std::chrono::seconds(1);
constexpr Duration longest_row = std::chrono::milliseconds(1);
constexpr int last_tag_id = 586;  // Of family 36h11.
constexpr std::size_t longest_name = 64, longest_words = 1000;
constexpr double rotation_tolerance = 1e-6;
constexpr double analogue_max = 1023.0;
constexpr int largest_control = 10'000'000;

Error refuse(std::string field, std::string found, std::string_view expected) {
  return make_error(ErrorCode::invalid_argument, fmt::format("found {}, expected {}", found, expected),
                    std::move(field));
}

Status check_number(const std::string& field, double value, double low, double high) {
  if (std::isfinite(value) && value >= low && value <= high) return {};
  return refuse(field, fmt::format("{}", value), fmt::format("{} to {}", low, high));
}

Status check_text(const std::string& field, const std::string& text, std::size_t longest) {
  const bool printable =
      std::all_of(text.begin(), text.end(), [](char c) { return static_cast<unsigned char>(c) >= 0x20; });
  if (text.size() <= longest && printable) return {};
  return refuse(field, fmt::format("{} bytes{}", text.size(), printable ? "" : " with control characters"),
                fmt::format("at most {} bytes in one line", longest));
}

Status check_pose(const std::string& field, const Eigen::Isometry3d& pose) {
  for (int axis = 0; axis < 3; ++axis) {
    const Status good =
        check_number(field + ".position_m", pose.translation()[axis], -max_place_m, max_place_m);
    if (!good) return good;
  }
  const Eigen::Matrix3d axes = pose.linear();
  const bool rotation = axes.allFinite() && axes.determinant() > 0 &&
                        (axes.transpose() * axes - Eigen::Matrix3d::Identity()).norm() < rotation_tolerance;
  if (!rotation) return refuse(field + ".orientation_wxyz", "no rotation", "a quaternion of length 1");
  return {};
}

Status check_colours(const std::string& field, const std::array<FingertipColour, finger_count>& colours) {
  for (std::size_t i = 0; i < colours.size(); ++i) {
    const FingertipColour& colour = colours[i];
    const std::string at = fmt::format("{}[{}]", field, i);
    if (colour.finger != static_cast<Finger>(i))
      return refuse(at + ".finger", fmt::format("{}", static_cast<int>(colour.finger)),
                    "the fingers in order");
    for (const auto& [key, value] : {std::pair{".y", colour.y}, {".cb", colour.cb}, {".cr", colour.cr}})
      if (const Status good = check_number(at + key, value, 0.0, 255.0); !good) return good;
    for (const auto& [key, value] : {std::pair{".sigma_cb", colour.sigma_cb}, {".sigma_cr", colour.sigma_cr}})
      if (const Status good = check_number(at + key, value, 0.1, max_sigma); !good) return good;
  }
  return {};
}

Status check_results(const std::string& field, const std::map<std::string, StepResult>& results) {
  for (const auto& [step, result] : results) {
    const std::string at = fmt::format("{}.{}", field, step);
    const bool plain = !step.empty() && step.size() <= longest_name &&
                       step.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789_") == std::string::npos;
    if (!plain) return refuse(field, fmt::format("the step '{}'", step), "lower-case letters, digits and _");
    if (const Status good = check_number(at + ".residual", result.residual, 0.0, max_residual); !good)
      return good;
    for (const auto& [key, text, longest] : {std::tuple{".unit", &result.unit, longest_name},
                                             {".date", &result.date, longest_name},
                                             {".words", &result.words, longest_words}})
      if (const Status good = check_text(at + key, *text, longest); !good) return good;
  }
  return {};
}

Status check_device(const std::string& field, const DeviceIdentity& device) {
  for (const auto& [key, text] :
       {std::pair{".model", &device.model}, {".serial", &device.serial}, {".path", &device.path}})
    if (const Status good = check_text(field + key, *text, 256); !good) return good;
  return {};
}

Status check_intrinsics(const std::string& field, const CameraIntrinsics& lens) {
  struct Value {
    const char* key;
    double value, low, high;
  };
  const double width = lens.width_px, height = lens.height_px;
  const Value values[] = {
      {".mode.width_px", width, 1, max_side_px},
      {".mode.height_px", height, 1, max_side_px},
      {".lens.focal_px", lens.fx_px, 1, max_focal_px},
      {".lens.focal_px", lens.fy_px, 1, max_focal_px},
      {".lens.centre_px", lens.cx_px, -width, 2 * width},
      {".lens.centre_px", lens.cy_px, -height, 2 * height},
  };
  for (const Value& value : values)
    if (const Status good = check_number(field + value.key, value.value, value.low, value.high); !good)
      return good;
  for (const double k : lens.distortion)
    if (const Status good = check_number(field + ".lens.distortion", k, -max_distortion, max_distortion);
        !good)
      return good;
  return {};
}

Status check_duration(const std::string& field, Duration value, Duration low, Duration high) {
  if (value >= low && value <= high) return {};
  return refuse(field, fmt::format("{}", value.count()), fmt::format("{} to {}", low.count(), high.count()));
}

Status check_camera(const std::string& at, const CameraCalibration& camera, const CameraRecord& record) {
  const bool plain =
      !camera.name.empty() && camera.name.size() <= longest_name &&
      camera.name.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789_-") == std::string::npos;
  if (!plain)
    return refuse(at + ".name", fmt::format("'{}'", camera.name), "lower-case letters, digits, - and _");
  if (const Status good = check_device(at + ".device", record.device); !good) return good;
  if (const Status good = check_intrinsics(at, camera.intrinsics); !good) return good;
  if (const Status good = check_number(at + ".mode.frames_per_s", record.frames_per_s, 1, max_frames_per_s);
      !good)
    return good;
  for (const Eigen::Isometry3d* pose : {&camera.world_from_camera, &camera.head_from_camera})
    if (const Status good = check_pose(at + ".pose", *pose); !good) return good;
  if (const Status good =
          check_duration(at + ".time.offset_ns", camera.time_offset, -longest_offset, longest_offset);
      !good)
    return good;
  // Negative: the picture is read from its last row.
  if (const Status good = check_duration(at + ".time.row_ns", camera.row_time, -longest_row, longest_row);
      !good)
    return good;
  const CameraControls& controls = record.controls;
  for (const auto& [key, value] : {std::pair{".exposure_100us", controls.exposure_100us},
                                   {".gain", controls.gain},
                                   {".white_balance_k", controls.white_balance_k},
                                   {".focus", controls.focus}})
    if (value)
      if (const Status good = check_number(at + ".controls" + key, *value, -largest_control, largest_control);
          !good)
        return good;
  if (record.colours)
    if (const Status good = check_colours(at + ".colours", *record.colours); !good) return good;
  return check_results(at + ".results", record.results);
}

Status check_tags(const char* list, const std::vector<TagPlacement>& tags, std::set<int>& ids) {
  if (tags.size() > max_body_tags)
    return refuse(list, fmt::format("{} tags", tags.size()), fmt::format("at most {}", max_body_tags));
  for (std::size_t i = 0; i < tags.size(); ++i) {
    const std::string at = fmt::format("{}[{}]", list, i);
    if (const Status good = check_number(at + ".id", tags[i].id, 0, last_tag_id); !good) return good;
    if (!ids.insert(tags[i].id).second)
      return refuse(at + ".id", fmt::format("{} again", tags[i].id),
                    "each tag once, on the table or the head");
    if (const Status good = check_number(at + ".edge_m", tags[i].edge_m, 0.001, max_edge_m); !good)
      return good;
    if (const Status good = check_pose(at, tags[i].body_from_tag); !good) return good;
  }
  return {};
}

std::string system_words() {
  return std::strerror(errno);  // NOLINT(concurrency-mt-unsafe): glibc's is safe.
}

Error io_error(const std::filesystem::path& path, std::string_view what) {
  return make_error(ErrorCode::io, fmt::format("{}: {}", what, system_words()), path.string());
}

}  // namespace

std::string_view to_string(Verdict verdict) {
  switch (verdict) {
    case Verdict::good:
      return "good";
    case Verdict::usable:
      return "usable";
    case Verdict::bad:
      return "bad";
  }
  return "bad";
}

Calibration calibration_of(const Rig& rig) {
  Calibration calibration;
  calibration.rig = rig;
  calibration.cameras.resize(rig.cameras.size());
  return calibration;
}

Rig rig_for_camera(const Calibration& calibration, std::size_t camera) {
  Rig rig = calibration.rig;
  if (calibration.cameras[camera].colours) rig.colours = *calibration.cameras[camera].colours;
  return rig;
}

Status check_device(const Calibration& calibration, std::size_t camera, const DeviceIdentity& found,
                    int width_px, int height_px) {
  if (camera >= calibration.rig.cameras.size() || camera >= calibration.cameras.size())
    return refuse("camera", fmt::format("{}", camera), "a camera of the calibration");
  const CameraCalibration& calibrated = calibration.rig.cameras[camera];
  const DeviceIdentity& expected = calibration.cameras[camera].device;
  const std::string field = "camera." + calibrated.name;
  const auto differs = [&](std::string_view what, const std::string& there, const std::string& wanted) {
    return make_error(
        ErrorCode::failed_precondition,
        fmt::format("found {} '{}', but the calibration belongs to '{}': calibrate this camera, "
                    "or plug in the other",
                    what, there, wanted),
        field);
  };
  if (!expected.model.empty()) {
    if (found.model != expected.model) return differs("a camera of model", found.model, expected.model);
    if (found.serial != expected.serial) return differs("the serial number", found.serial, expected.serial);
    if (expected.serial.empty() && found.path != expected.path)
      return differs("it at the port", found.path, expected.path);
  }
  const CameraIntrinsics& lens = calibrated.intrinsics;
  if (width_px != lens.width_px || height_px != lens.height_px) {
    return make_error(
        ErrorCode::failed_precondition,
        fmt::format("found pictures of {} x {}, but '{}' is calibrated for {} x {}: choose that "
                    "mode, or calibrate this one",
                    width_px, height_px, calibrated.name, lens.width_px, lens.height_px),
        field);
  }
  return {};
}

Status check_calibration(const Calibration& calibration) {
  const Rig& rig = calibration.rig;
  if (const Status good = check_text("date", calibration.date, longest_name); !good) return good;
  if (rig.cameras.size() > max_rig_cameras)
    return refuse("camera", fmt::format("{} cameras", rig.cameras.size()),
                  fmt::format("at most {}", max_rig_cameras));
  if (rig.cameras.size() != calibration.cameras.size())
    return refuse("camera", fmt::format("{} records", calibration.cameras.size()),
                  fmt::format("one for each of {} cameras", rig.cameras.size()));
  std::set<std::string> names;
  for (std::size_t i = 0; i < rig.cameras.size(); ++i) {
    const std::string at = fmt::format("camera[{}]", i);
    if (const Status good = check_camera(at, rig.cameras[i], calibration.cameras[i]); !good) return good;
    if (!names.insert(rig.cameras[i].name).second)
      return refuse(at + ".name", fmt::format("'{}' again", rig.cameras[i].name), "each name once");
  }
  std::set<int> ids;
  if (const Status good = check_tags("table_tag", rig.table_tags, ids); !good) return good;
  if (const Status good = check_tags("head_tag", rig.head_tags, ids); !good) return good;
  if (const Status good = check_number("fingertips.radius_m", rig.fingertip_radius_m, 0.0005, max_radius_m);
      !good)
    return good;
  if (const Status good = check_colours("fingertips", rig.colours); !good) return good;
  if (calibration.glove) {
    const GloveRanges& glove = *calibration.glove;
    if (const Status good = check_device("glove.device", glove.device); !good) return good;
    struct Range {
      const char *low_key, *high_key;
      double low, high;
    };
    for (const Range& range :
         {Range{"glove.force_zero", "glove.force_full", glove.force_zero, glove.force_full},
          Range{"glove.potentiometer_low", "glove.potentiometer_high", glove.potentiometer_low,
                glove.potentiometer_high}}) {
      if (const Status good = check_number(range.low_key, range.low, 0, analogue_max); !good) return good;
      if (const Status good = check_number(range.high_key, range.high, 0, analogue_max); !good) return good;
      if (range.high - range.low < 1.0)
        return refuse(range.high_key, fmt::format("{}", range.high),
                      fmt::format("at least one step above {} ({})", range.low_key, range.low));
    }
  }
  return check_results("results", calibration.results);
}

Result<Calibration> load_calibration(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in) {
    const auto code = errno == ENOENT ? ErrorCode::not_found : ErrorCode::io;
    return make_error(code, fmt::format("could not open the calibration file: {}", system_words()),
                      path.string());
  }
  std::string text(max_calibration_bytes + 1, '\0');
  in.read(text.data(), static_cast<std::streamsize>(text.size()));
  if (in.bad()) return io_error(path, "could not read the calibration file");
  text.resize(static_cast<std::size_t>(in.gcount()));
  return parse_calibration(text, path.string());
}

Status save_calibration(const Calibration& calibration, const std::filesystem::path& path) {
  const Result<std::string> text = format_calibration(calibration);
  if (!text) return text.error();
  const std::string temporary = path.string() + ".new";
  const int file = ::open(temporary.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
  if (file < 0) return io_error(temporary, "could not write the calibration file");
  const auto give_up = [&](std::string_view what) {
    const Error error = io_error(temporary, what);
    ::close(file);
    ::unlink(temporary.c_str());
    return error;
  };
  for (std::size_t done = 0; done < text->size();) {
    const ssize_t wrote = ::write(file, text->data() + done, text->size() - done);
    if (wrote < 0 && errno == EINTR) continue;
    if (wrote <= 0) return give_up("could not write the calibration file");
    done += static_cast<std::size_t>(wrote);
  }
  if (::fsync(file) != 0) return give_up("could not bring the calibration file to the disk");
  ::close(file);
  if (::rename(temporary.c_str(), path.c_str()) != 0) {
    const Error error = io_error(path, "could not put the new calibration file in place");
    ::unlink(temporary.c_str());
    return error;
  }
  return {};
}

}  // namespace handloft::tracking
