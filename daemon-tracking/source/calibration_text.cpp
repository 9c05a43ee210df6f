// The text of a calibration file: reading and writing.

#include <fmt/format.h>
#include <toml++/toml.h>

#include <cmath>
#include <sstream>

#include "daemon-tracking/source/calibration_file.h"

namespace handloft::tracking {
namespace {

constexpr std::array<const char*, finger_count> finger_names = {"thumb", "index", "middle", "ring", "little"};
constexpr std::array<std::pair<PixelFormat, const char*>, 3> format_names = {
    {{PixelFormat::mjpeg, "mjpeg"}, {PixelFormat::yuyv, "yuyv"}, {PixelFormat::grey, "grey"}}};
constexpr std::array<std::pair<CameraRole, const char*>, 2> role_names = {
    {{CameraRole::table, "table"}, {CameraRole::head, "head"}}};
constexpr std::array<std::pair<Verdict, const char*>, 3> verdict_names = {
    {{Verdict::good, "good"}, {Verdict::usable, "usable"}, {Verdict::bad, "bad"}}};
constexpr double quaternion_tolerance = 1e-3;  // Of a length typed by hand; it is then made 1.

std::string describe(const toml::node& node) {
  if (node.is_table()) return "a table";
  if (node.is_array()) return fmt::format("a list of {}", node.as_array()->size());
  std::ostringstream text;
  node.visit([&text](const auto& value) { text << value; });
  constexpr std::size_t shown = 60;
  return text.str().substr(0, shown);
}

/// Reads one table; the first problem is kept and all that follows does nothing. A key that nobody asked for
/// is a problem too, see finish().
class Reader {
 public:
  Reader(const toml::table& table, std::string path, const std::string& file_name,
         std::optional<Error>& problem)
      : table_(table), path_(std::move(path)), file_name_(file_name), problem_(problem) {}

  void number(const char* key, double& to) {
    take(key, "a number", [&](const auto& node) { return as(node, to); });
  }
  void whole(const char* key, int& to) {
    take(key, "a whole number", [&](const auto& node) { return as(node, to); });
  }
  void whole(const char* key, std::optional<int>& to) {
    if (table_.contains(key)) whole(key, to.emplace());
  }
  void text(const char* key, std::string& to) {
    take(key, "text in quotes", [&](const auto& node) { return as(node, to); });
  }
  void duration(const char* key, Duration& to) {
    take(key, "whole nanoseconds", [&](const toml::node& node) {
      const auto value = node.value_exact<std::int64_t>();
      if (value) to = Duration(*value);
      return value.has_value();
    });
  }
  template <std::size_t size>
  void numbers(const char* key, std::array<double, size>& to) {
    take(key, fmt::format("a list of {} numbers", size), [&](const toml::node& node) {
      const toml::array* list = node.as_array();
      if (list == nullptr || list->size() != size) return false;
      bool good = true;
      for (std::size_t i = 0; i < size; ++i) good = good && as((*list)[i], to[i]);
      return good;
    });
  }
  template <typename Enum, std::size_t size>
  void choice(const char* key, Enum& to, const std::array<std::pair<Enum, const char*>, size>& names) {
    std::string expected;
    for (const auto& [value, name] : names)
      expected += fmt::format("{}\"{}\"", expected.empty() ? "" : " or ", name);
    take(key, expected, [&](const toml::node& node) {
      const auto word = node.value_exact<std::string>();
      for (const auto& [value, name] : names) {
        if (word != name) continue;
        to = value;
        return true;
      }
      return false;
    });
  }
  void pose(Eigen::Isometry3d& to) {
    std::array<double, 3> position{};
    std::array<double, 4> wxyz{1, 0, 0, 0};
    numbers("position_m", position);
    numbers("orientation_wxyz", wxyz);
    if (problem_) return;
    Eigen::Quaterniond rotation(wxyz[0], wxyz[1], wxyz[2], wxyz[3]);
    if (!(std::abs(rotation.norm() - 1.0) < quaternion_tolerance)) {
      complain("orientation_wxyz", fmt::format("a length of {}", rotation.norm()),
               "a quaternion of length 1");
      return;
    }
    rotation.normalize();
    to = Eigen::Isometry3d::Identity();
    to.linear() = rotation.toRotationMatrix();
    to.translation() = Eigen::Vector3d(position[0], position[1], position[2]);
  }

  enum class Presence { required, optional };
  /// `read` gets a Reader of the sub-table.
  template <typename Read>
  void table(const char* key, Presence presence, const Read& read) {
    if (presence == Presence::optional && !table_.contains(key)) return;
    take(key, "a table", [&](const toml::node& node) {
      if (!node.is_table()) return false;
      Reader inner(*node.as_table(), path_.empty() ? key : fmt::format("{}.{}", path_, key), file_name_,
                   problem_);
      read(inner);
      inner.finish();
      return true;
    });
  }
  /// The tables of a list, one after the other; none when it is not there.
  template <typename Read>
  void tables(const char* key, std::size_t most, const Read& read) {
    if (!table_.contains(key)) return;
    const std::string expected = fmt::format("at most {} tables [[{}]]", most, key);
    take(key, expected, [&](const toml::node& node) {
      const toml::array* list = node.as_array();
      if (list == nullptr || list->size() > most) return false;
      for (std::size_t i = 0; i < list->size(); ++i) {
        const toml::table* one = (*list)[i].as_table();
        if (one == nullptr) return false;
        Reader inner(*one, fmt::format("{}[{}]", key, i), file_name_, problem_);
        read(inner);
        inner.finish();
      }
      return true;
    });
  }
  void results(std::map<std::string, StepResult>& to) {
    table("results", Presence::optional, [&](Reader& steps) {
      constexpr std::size_t most = 32;
      std::size_t count = 0;
      for (const auto& [step, node] : steps.table_) {
        if (++count > most) return steps.complain("", "more steps", fmt::format("at most {}", most));
        const std::string name(step.str());
        steps.table(name.c_str(), Presence::required, [&](Reader& in) {
          StepResult& result = to[name];
          in.choice("verdict", result.verdict, verdict_names);
          in.number("residual", result.residual);
          in.text("unit", result.unit);
          in.text("date", result.date);
          in.text("words", result.words);
        });
      }
    });
  }
  void colours(std::array<FingertipColour, finger_count>& to) {
    for (std::size_t i = 0; i < finger_names.size(); ++i) {
      table(finger_names[i], Presence::required, [&](Reader& in) {
        to[i].finger = static_cast<Finger>(i);
        in.number("y", to[i].y);
        in.number("cb", to[i].cb);
        in.number("cr", to[i].cr);
        in.number("sigma_cb", to[i].sigma_cb);
        in.number("sigma_cr", to[i].sigma_cr);
      });
    }
  }
  void device(DeviceIdentity& to) {
    table("device", Presence::required, [&](Reader& in) {
      in.text("model", to.model);
      in.text("serial", to.serial);
      in.text("path", to.path);
    });
  }
  bool has(const char* key) const { return table_.contains(key); }

  void finish() {
    for (const auto& [key, node] : table_) {
      if (problem_) return;
      if (std::find(known_.begin(), known_.end(), key.str()) != known_.end()) continue;
      problem_ = make_error(ErrorCode::invalid_argument, "there is no such key here",
                            where(std::string(key.str()), key.source().begin.line));
    }
  }

 private:
  static bool as(const toml::node& node, double& to) {
    if (!node.is_floating_point() && !node.is_integer()) return false;
    to = node.value<double>().value_or(0.0);
    return true;
  }
  static bool as(const toml::node& node, int& to) {
    const auto value = node.value_exact<std::int64_t>();
    if (!value || !std::in_range<int>(*value)) return false;
    to = static_cast<int>(*value);
    return true;
  }
  static bool as(const toml::node& node, std::string& to) {
    const auto value = node.value_exact<std::string>();
    if (value) to = *value;
    return value.has_value();
  }

  template <typename Convert>
  void take(const char* key, const std::string& expected, const Convert& convert) {
    known_.emplace_back(key);
    if (problem_) return;
    const toml::node* node = table_.get(key);
    if (node == nullptr) {
      problem_ = make_error(ErrorCode::invalid_argument, fmt::format("it is missing, expected {}", expected),
                            where(key, table_.source().begin.line));
    } else if (!convert(*node)) {
      complain(key, describe(*node), expected);
    }
  }
  void complain(const std::string& key, const std::string& found, const std::string& expected) {
    const toml::node* node = table_.get(key);
    const auto line = node != nullptr ? node->source().begin.line : table_.source().begin.line;
    if (!problem_)
      problem_ = make_error(ErrorCode::invalid_argument,
                            fmt::format("found {}, expected {}", found, expected), where(key, line));
  }
  std::string where(const std::string& key, toml::source_index line) const {
    return fmt::format("{}:{}: {}{}{}", file_name_, line, path_, path_.empty() || key.empty() ? "" : ".",
                       key);
  }

  const toml::table& table_;
  std::string path_;
  const std::string& file_name_;
  std::optional<Error>& problem_;
  std::vector<std::string> known_;
};

using Presence = Reader::Presence;

void read_camera(Reader& in, CameraCalibration& camera, CameraRecord& record) {
  in.text("name", camera.name);
  in.choice("role", camera.role, role_names);
  in.device(record.device);
  in.table("mode", Presence::required, [&](Reader& mode) {
    mode.whole("width_px", camera.intrinsics.width_px);
    mode.whole("height_px", camera.intrinsics.height_px);
    mode.choice("format", record.format, format_names);
    mode.number("frames_per_s", record.frames_per_s);
  });
  in.table("lens", Presence::required, [&](Reader& lens) {
    std::array<double, 2> focal{}, centre{};
    lens.numbers("focal_px", focal);
    lens.numbers("centre_px", centre);
    lens.numbers("distortion", camera.intrinsics.distortion);
    camera.intrinsics.fx_px = focal[0];
    camera.intrinsics.fy_px = focal[1];
    camera.intrinsics.cx_px = centre[0];
    camera.intrinsics.cy_px = centre[1];
  });
  Eigen::Isometry3d& place =
      camera.role == CameraRole::table ? camera.world_from_camera : camera.head_from_camera;
  in.table("pose", Presence::required, [&](Reader& pose) { pose.pose(place); });
  in.table("time", Presence::required, [&](Reader& time) {
    time.duration("offset_ns", camera.time_offset);
    time.duration("row_ns", camera.row_time);
  });
  in.table("controls", Presence::optional, [&](Reader& controls) {
    controls.whole("exposure_100us", record.controls.exposure_100us);
    controls.whole("gain", record.controls.gain);
    controls.whole("white_balance_k", record.controls.white_balance_k);
    controls.whole("focus", record.controls.focus);
  });
  in.table("colours", Presence::optional,
           [&](Reader& colours) { colours.colours(record.colours.emplace()); });
  in.results(record.results);
}

void read_tags(Reader& in, const char* list, std::vector<TagPlacement>& tags) {
  in.tables(list, max_body_tags, [&](Reader& one) {
    TagPlacement& tag = tags.emplace_back();
    one.whole("id", tag.id);
    one.number("edge_m", tag.edge_m);
    one.pose(tag.body_from_tag);
  });
}

void read_all(Reader& in, Calibration& calibration) {
  in.text("date", calibration.date);
  in.tables("camera", max_rig_cameras, [&](Reader& one) {
    read_camera(one, calibration.rig.cameras.emplace_back(), calibration.cameras.emplace_back());
  });
  read_tags(in, "table_tag", calibration.rig.table_tags);
  read_tags(in, "head_tag", calibration.rig.head_tags);
  in.table("fingertips", Presence::required, [&](Reader& tips) {
    tips.number("radius_m", calibration.rig.fingertip_radius_m);
    tips.colours(calibration.rig.colours);
  });
  in.table("glove", Presence::optional, [&](Reader& one) {
    GloveRanges& glove = calibration.glove.emplace();
    one.device(glove.device);
    one.number("force_zero", glove.force_zero);
    one.number("force_full", glove.force_full);
    one.number("potentiometer_low", glove.potentiometer_low);
    one.number("potentiometer_high", glove.potentiometer_high);
  });
  in.results(calibration.results);
}

// Writing. Numbers in the fewest digits that read back the same; a point or exponent makes them floating.
std::string number(double value) {
  std::string text = fmt::format("{}", value);
  if (text.find_first_of(".e") == std::string::npos) text += ".0";
  return text;
}

std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    out += c;
  }
  return out + '"';
}

template <typename Name, std::size_t size>
std::string name_of(Name value, const std::array<std::pair<Name, const char*>, size>& names) {
  for (const auto& [one, name] : names)
    if (one == value) return quoted(name);
  return quoted("");
}

template <typename List>
std::string numbers(const List& list) {
  std::string text;
  for (const double value : list) text += (text.empty() ? "" : ", ") + number(value);
  return "[" + text + "]";
}

std::string pose_text(const Eigen::Isometry3d& pose, const char* separator) {
  const Eigen::Quaterniond rotation(pose.linear());
  const Eigen::Vector3d& at = pose.translation();
  return fmt::format("position_m = {}{}orientation_wxyz = {}", numbers(std::array{at.x(), at.y(), at.z()}),
                     separator, numbers(std::array{rotation.w(), rotation.x(), rotation.y(), rotation.z()}));
}

std::string device_text(const DeviceIdentity& device) {
  return fmt::format("device = {{ model = {}, serial = {}, path = {} }}\n", quoted(device.model),
                     quoted(device.serial), quoted(device.path));
}

std::string colours_text(const char* prefix, const std::array<FingertipColour, finger_count>& colours) {
  std::string text;
  for (std::size_t i = 0; i < colours.size(); ++i)
    text += fmt::format("{}{} = {{ y = {}, cb = {}, cr = {}, sigma_cb = {}, sigma_cr = {} }}\n", prefix,
                        finger_names[i], number(colours[i].y), number(colours[i].cb), number(colours[i].cr),
                        number(colours[i].sigma_cb), number(colours[i].sigma_cr));
  return text;
}

std::string results_text(const char* prefix, const std::map<std::string, StepResult>& results) {
  std::string text;
  for (const auto& [step, result] : results)
    text += fmt::format("{}{} = {{ verdict = {}, residual = {}, unit = {}, date = {}, words = {} }}\n",
                        prefix, step, name_of(result.verdict, verdict_names), number(result.residual),
                        quoted(result.unit), quoted(result.date), quoted(result.words));
  return text;
}

std::string camera_text(const CameraCalibration& camera, const CameraRecord& record) {
  const CameraIntrinsics& lens = camera.intrinsics;
  std::string text = fmt::format("\n[[camera]]\nname = {}\nrole = {}\n", quoted(camera.name),
                                 name_of(camera.role, role_names));
  text += device_text(record.device);
  text += fmt::format("mode = {{ width_px = {}, height_px = {}, format = {}, frames_per_s = {} }}\n",
                      lens.width_px, lens.height_px, name_of(record.format, format_names),
                      number(record.frames_per_s));
  text += fmt::format("lens = {{ focal_px = {}, centre_px = {}, distortion = {} }}\n",
                      numbers(std::array{lens.fx_px, lens.fy_px}),
                      numbers(std::array{lens.cx_px, lens.cy_px}), numbers(lens.distortion));
  text += fmt::format(
      "pose = {{ {} }}\n",
      pose_text(camera.role == CameraRole::table ? camera.world_from_camera : camera.head_from_camera, ", "));
  text += fmt::format("time = {{ offset_ns = {}, row_ns = {} }}\n", camera.time_offset.count(),
                      camera.row_time.count());
  std::string controls;
  for (const auto& [key, value] : {std::pair{"exposure_100us", record.controls.exposure_100us},
                                   {"gain", record.controls.gain},
                                   {"white_balance_k", record.controls.white_balance_k},
                                   {"focus", record.controls.focus}})
    if (value) controls += fmt::format("{} {} = {}", controls.empty() ? "" : ",", key, *value);
  if (!controls.empty()) text += fmt::format("controls = {{{} }}\n", controls);
  if (record.colours) text += colours_text("colours.", *record.colours);
  return text + results_text("results.", record.results);
}

}  // namespace

Result<Calibration> parse_calibration(std::string_view text, const std::string& file_name) {
  if (text.size() > max_calibration_bytes)
    return make_error(
        ErrorCode::resource_exhausted,
        fmt::format("the file is larger than {} bytes, expected a calibration file", max_calibration_bytes),
        file_name);
  toml::table table;
  try {
    table = toml::parse(text, file_name);
  } catch (const toml::parse_error& error) {
    return make_error(ErrorCode::data_corrupt, std::string(error.description()),
                      fmt::format("{}:{}", file_name, error.source().begin.line));
  } catch (const std::exception& error) {
    return make_error(ErrorCode::data_corrupt, error.what(), file_name);
  }
  std::optional<Error> problem;
  Reader in(table, "", file_name, problem);
  int version = 0;
  in.whole("version", version);
  if (!problem && version != calibration_version)
    return make_error(
        ErrorCode::unsupported,
        fmt::format("found version {}, expected {}: calibrate again", version, calibration_version),
        file_name);
  Calibration calibration;
  read_all(in, calibration);
  in.finish();
  if (problem) return *problem;
  if (const Status good = check_calibration(calibration); !good) {
    Error error = good.error();
    error.field = fmt::format("{}: {}", file_name, error.field);
    return error;
  }
  return calibration;
}

Result<std::string> format_calibration(const Calibration& calibration) {
  if (const Status good = check_calibration(calibration); !good) return good.error();
  std::string text = fmt::format(
      "# What handloft-calibrate measured; handloft-trackd reads it. Metres, nanoseconds, pixels.\n"
      "version = {}\ndate = {}\n",
      calibration_version, quoted(calibration.date));
  text += results_text("results.", calibration.results);
  const auto tags = [&text](const char* list, const std::vector<TagPlacement>& of) {
    for (const TagPlacement& tag : of)
      text += fmt::format("\n[[{}]]\nid = {}\nedge_m = {}\n{}\n", list, tag.id, number(tag.edge_m),
                          pose_text(tag.body_from_tag, "\n"));
  };
  for (std::size_t i = 0; i < calibration.cameras.size(); ++i)
    text += camera_text(calibration.rig.cameras[i], calibration.cameras[i]);
  tags("table_tag", calibration.rig.table_tags);
  tags("head_tag", calibration.rig.head_tags);
  text += fmt::format("\n[fingertips]\nradius_m = {}\n", number(calibration.rig.fingertip_radius_m));
  text += colours_text("", calibration.rig.colours);
  if (calibration.glove) {
    const GloveRanges& glove = *calibration.glove;
    text += "\n[glove]\n" + device_text(glove.device);
    text += fmt::format("force_zero = {}\nforce_full = {}\npotentiometer_low = {}\npotentiometer_high = {}\n",
                        number(glove.force_zero), number(glove.force_full), number(glove.potentiometer_low),
                        number(glove.potentiometer_high));
  }
  return text;
}

}  // namespace handloft::tracking
