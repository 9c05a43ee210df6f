#include "client-hmd/shots/shot_script.h"

#include <fmt/format.h>
#include <toml++/toml.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <glm/gtc/constants.hpp>
#include <set>
#include <sstream>
#include <utility>

namespace handloft::client {
namespace {

constexpr double nearest_m = 0.01, farthest_m = 100.0;
constexpr double reach_m = 1000.0;  ///< Of eyes and targets.
constexpr double steepest_deg = 89.9;
constexpr double most_turns_deg = 36'000.0;
constexpr double narrowest_deg = 1.0, widest_deg = 120.0;
constexpr double slowest_hz = 1.0, fastest_hz = 240.0;
constexpr std::int64_t most_samples = 4;
constexpr int smallest_px = 16, largest_px = 8192;

template <typename T>
struct Named {
  const char* name;
  T value;
};

/// Reads one table of the file: what it is asked for, and in the end that there was nothing else.
class TableReader {
 public:
  TableReader(const toml::table& table, std::string path, const std::string& file)
      : table_(table), path_(std::move(path)), file_(file) {}

  /// The node of `key`; null when absent.
  const toml::node* find(const char* key) {
    known_.insert(key);
    return table_.get(key);
  }
  bool has(const char* key) { return find(key) != nullptr; }

  Error wrong(const char* key, const std::string& expected) const {
    const toml::node* node = table_.get(key);
    return error_at(
        node == nullptr ? table_.source() : node->source(), key,
        fmt::format("found {}, expected {}", node == nullptr ? "nothing" : describe(*node), expected));
  }

  Status number(const char* key, double low, double high, double& out) {
    const toml::node* node = find(key);
    if (node == nullptr) return {};
    const bool is_number = node->is_floating_point() || node->is_integer();
    const std::optional<double> value = is_number ? node->value<double>() : std::nullopt;
    if (!value || !(*value >= low && *value <= high)) return wrong(key, fmt::format("{}..{}", low, high));
    out = *value;
    return {};
  }
  Status whole(const char* key, std::int64_t low, std::int64_t high, int& out) {
    const toml::node* node = find(key);
    if (node == nullptr) return {};
    const std::optional<std::int64_t> value = node->value_exact<std::int64_t>();
    if (!value || *value < low || *value > high) return wrong(key, fmt::format("{}..{}", low, high));
    out = static_cast<int>(*value);
    return {};
  }
  Status boolean(const char* key, bool& out) {
    const toml::node* node = find(key);
    if (node == nullptr) return {};
    const std::optional<bool> value = node->value_exact<bool>();
    if (!value) return wrong(key, "true or false");
    out = *value;
    return {};
  }
  Status place(const char* key, glm::dvec3& out) {
    const toml::node* node = find(key);
    if (node == nullptr) return {};
    const std::string expected = fmt::format("[x, y, z] in metres within {}", reach_m);
    const toml::array* array = node->as_array();
    if (array == nullptr || array->size() != 3) return wrong(key, expected);
    for (std::size_t i = 0; i < 3; ++i) {
      const toml::node& element = *array->get(i);
      const bool is_number = element.is_floating_point() || element.is_integer();
      const std::optional<double> value = is_number ? element.value<double>() : std::nullopt;
      if (!value || !(std::abs(*value) <= reach_m)) return wrong(key, expected);
      out[static_cast<int>(i)] = *value;
    }
    return {};
  }
  template <typename T, std::size_t N>
  Status choice(const char* key, const std::array<Named<T>, N>& choices, T& out) {
    const toml::node* node = find(key);
    if (node == nullptr) return {};
    const std::optional<std::string> value = node->value_exact<std::string>();
    std::string names;
    for (const Named<T>& item : choices) {
      if (value && *value == item.name) {
        out = item.value;
        return {};
      }
      names += fmt::format("{}\"{}\"", names.empty() ? "" : ", ", item.name);
    }
    return wrong(key, "one of " + names);
  }

  /// Keys that nobody asked for.
  Status all_known() const {
    for (const auto& [key, node] : table_) {
      const std::string name(key.str());
      if (known_.count(name) == 0) return error_at(node.source(), name.c_str(), "is no field of a script");
    }
    return {};
  }

  Error error_at(const toml::source_region& where, const char* key, const std::string& message) const {
    constexpr std::size_t longest_key = 64;
    const std::string shown = std::string(key).substr(0, longest_key);
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("{} ({}, line {})", message, file_, where.begin.line),
                      path_.empty() ? shown : path_ + "." + shown);
  }

 private:
  static std::string describe(const toml::node& node) {
    if (node.is_table()) return "a table";
    if (node.is_array()) return "a list that does not fit";
    std::ostringstream text;
    node.visit([&text](const auto& value) { text << value; });
    constexpr std::size_t longest = 64;
    return text.str().substr(0, longest);
  }

  const toml::table& table_;
  std::string path_;
  const std::string& file_;
  std::set<std::string> known_;
};

Status read_size(TableReader& reader, ShotPlan& plan) {
  const toml::node* node = reader.find("size");
  if (node == nullptr) return {};
  const std::optional<std::string> text = node->value_exact<std::string>();
  int width = 0;
  int height = 0;
  char end = 0;
  const bool two = text && std::sscanf(text->c_str(), "%5dx%5d%c", &width, &height, &end) == 2;
  if (!two || std::min(width, height) < smallest_px || std::max(width, height) > largest_px) {
    return reader.wrong("size", fmt::format("\"WIDTHxHEIGHT\" within {}..{}", smallest_px, largest_px));
  }
  plan.width_px = width;
  plan.height_px = height;
  return {};
}

Status first_of(std::initializer_list<Status> statuses) {
  for (const Status& status : statuses) {
    if (!status) return status;
  }
  return {};
}

Status read_head(TableReader& reader, ShotPlan& plan) {
  constexpr std::array easings{Named<Easing>{"smooth", Easing::smooth},
                               Named<Easing>{"linear", Easing::linear}};
  constexpr std::array backgrounds{Named<ShotBackground>{"studio", ShotBackground::studio},
                                   Named<ShotBackground>{"transparent", ShotBackground::transparent}};
  bool loop = false;
  bool stereo = false;
  const Status read =
      first_of({read_size(reader, plan), reader.number("rate", slowest_hz, fastest_hz, plan.rate_hz),
                reader.whole("supersampling", 1, most_samples, plan.supersampling),
                reader.choice("easing", easings, plan.easing), reader.boolean("loop", loop),
                reader.choice("background", backgrounds, plan.background), reader.boolean("stereo", stereo),
                reader.number("eye_distance", 0.0, 0.2, plan.eye_distance_m)});
  if (loop) plan.ends = CameraPath::Ends::loop;
  if (stereo) plan.eyes = ShotEyes::side_by_side;
  return read;
}

Status read_time(TableReader& reader, double latest_s, double& time_s) {
  if (!reader.has("time")) return reader.wrong("time", "seconds");
  return reader.number("time", 0.0, latest_s, time_s);
}

Status read_orbit(const toml::node& node, const std::string& path, const std::string& file,
                  OrbitPlace& orbit) {
  TableReader reader(*node.as_table(), path + ".orbit", file);
  double azimuth_deg = glm::degrees(OrbitCamera().azimuth_rad);
  double elevation_deg = glm::degrees(OrbitCamera().elevation_rad);
  double distance_m = 0.0;
  if (const Status read =
          first_of({reader.number("azimuth", -most_turns_deg, most_turns_deg, azimuth_deg),
                    reader.number("elevation", -steepest_deg, steepest_deg, elevation_deg),
                    reader.number("distance", nearest_m, farthest_m, distance_m), reader.all_known()});
      !read) {
    return read;
  }
  orbit.azimuth_rad = glm::radians(azimuth_deg);
  orbit.elevation_rad = glm::radians(elevation_deg);
  if (reader.has("distance")) orbit.distance_m = distance_m;
  return {};
}

Status read_target(TableReader& reader, Target& target) {
  const toml::node* node = reader.find("target");
  if (node == nullptr || (node->is_string() && node->value_exact<std::string>() == "scene")) return {};
  if (!node->is_array()) return reader.wrong("target", "\"scene\" or [x, y, z]");
  glm::dvec3 place(0.0);
  if (const Status read = reader.place("target", place); !read) return read;
  target = place;
  return {};
}

Result<PlannedKey> read_key(const toml::table& table, const std::string& path, const std::string& file,
                            const ShotLimits& limits) {
  TableReader reader(table, path, file);
  PlannedKey key;
  double fov_deg = glm::degrees(key.fov_y_rad);
  if (const Status read =
          first_of({read_time(reader, limits.max_duration_s, key.time_s), read_target(reader, key.target),
                    reader.number("field_of_view", narrowest_deg, widest_deg, fov_deg)});
      !read) {
    return read.error();
  }
  key.fov_y_rad = glm::radians(fov_deg);
  const toml::node* orbit = reader.find("orbit");
  const bool has_eye = reader.has("eye");
  if ((orbit != nullptr) == has_eye) {
    return reader.error_at(table.source(), "eye", "expected either an eye or an orbit");
  }
  if (has_eye) {
    glm::dvec3 eye(0.0);
    if (const Status read = reader.place("eye", eye); !read) return read.error();
    key.place = eye;
    const auto* target = std::get_if<glm::dvec3>(&key.target);
    if (target != nullptr && glm::distance(*target, eye) < nearest_m) {
      return reader.wrong("eye", fmt::format("a place {} m from the target at least", nearest_m));
    }
  } else {
    if (!orbit->is_table()) return reader.wrong("orbit", "{ azimuth = .., elevation = .., distance = .. }");
    OrbitPlace place;
    if (const Status read = read_orbit(*orbit, path, file, place); !read) return read.error();
    key.place = place;
  }
  if (const Status known = reader.all_known(); !known) return known.error();
  return key;
}

Status read_shading(TableReader& reader, PlannedChange& change) {
  const toml::node* node = reader.find("shading");
  if (node == nullptr) return {};
  const std::optional<std::string> name = node->value_exact<std::string>();
  change.shading = name ? shading_named(*name) : std::nullopt;
  if (change.shading) return {};
  std::string names;
  for (const NamedChoice<Shading>& item : shadings()) {
    names += fmt::format("{}\"{}\"", names.empty() ? "" : ", ", item.name);
  }
  return reader.wrong("shading", "one of " + names);
}

Result<PlannedChange> read_change(const toml::table& table, const std::string& path, const std::string& file,
                                  const ShotLimits& limits) {
  constexpr std::array representations{Named<Representation>{"points", Representation::points},
                                       Named<Representation>{"surface", Representation::surface},
                                       Named<Representation>{"both", Representation::both}};
  TableReader reader(table, path, file);
  PlannedChange change;
  Representation show = Representation::both;
  if (const Status read = first_of({read_time(reader, limits.max_duration_s, change.time_s),
                                    reader.choice("show", representations, show),
                                    read_shading(reader, change), reader.all_known()});
      !read) {
    return read.error();
  }
  if (reader.has("show")) change.show = show;
  return change;
}

/// The tables of `[[name]]`, each read by `read`, with times that grow.
template <typename Item, typename Read>
Status read_list(TableReader& reader, const char* name, std::size_t most, const std::string& file, Read read,
                 std::vector<Item>& out) {
  const toml::node* node = reader.find(name);
  if (node == nullptr) return {};
  const toml::array* array = node->as_array();
  if (array == nullptr || (!array->empty() && !array->is_homogeneous(toml::node_type::table))) {
    return reader.wrong(name, fmt::format("[[{}]] tables", name));
  }
  if (array->size() > most) {
    return make_error(ErrorCode::resource_exhausted,
                      fmt::format("found {}, expected at most {} ({})", array->size(), most, file), name);
  }
  for (const toml::node& element : *array) {
    const std::string path = fmt::format("{}[{}]", name, out.size());
    Result<Item> item = read(*element.as_table(), path);
    if (!item) return item.error();
    if (!out.empty() && !(item->time_s > out.back().time_s)) {
      return TableReader(*element.as_table(), path, file)
          .wrong("time", fmt::format("more than the {} s of the one before", out.back().time_s));
    }
    out.push_back(std::move(*item));
  }
  return {};
}

Status check_whole(const ShotPlan& plan, TableReader& reader, const ShotLimits& limits) {
  if (plan.keys.empty()) return reader.wrong("key", "one [[key]] at least");
  if (plan.keys.front().time_s != 0.0) {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {}, expected 0 for the first key", plan.keys.front().time_s),
                      "key[0].time");
  }
  if (plan.ends == CameraPath::Ends::loop && plan.keys.size() < 2) {
    return reader.wrong("key", "two at least for a loop");
  }
  if (plan.frames() > limits.max_frames) {
    return make_error(
        ErrorCode::resource_exhausted,
        fmt::format("the script asks for {} pictures, expected at most {}", plan.frames(), limits.max_frames),
        "rate");
  }
  return {};
}

}  // namespace

Result<ShotPlan> parse_shot_script(std::string_view text, const std::string& file_name,
                                   const ShotLimits& limits) {
  if (text.size() > limits.max_file_bytes) {
    return make_error(ErrorCode::resource_exhausted,
                      fmt::format("found {} bytes, expected at most {}", text.size(), limits.max_file_bytes),
                      file_name);
  }
  toml::table table;
  try {
    table = toml::parse(text, file_name);
  } catch (const toml::parse_error& error) {
    return make_error(ErrorCode::invalid_argument, std::string(error.description()),
                      fmt::format("{}:{}", file_name, error.source().begin.line));
  }
  ShotPlan plan;
  TableReader reader(table, "", file_name);
  const auto key = [&](const toml::table& item, const std::string& path) {
    return read_key(item, path, file_name, limits);
  };
  const auto change = [&](const toml::table& item, const std::string& path) {
    return read_change(item, path, file_name, limits);
  };
  for (const Status& read :
       {read_head(reader, plan), read_list(reader, "key", limits.max_keys, file_name, key, plan.keys),
        read_list(reader, "change", limits.max_changes, file_name, change, plan.changes),
        reader.all_known()}) {
    if (!read) return read.error();
  }
  if (const Status whole = check_whole(plan, reader, limits); !whole) return whole.error();
  return plan;
}

Result<ShotPlan> read_shot_script(const std::filesystem::path& path, const ShotLimits& limits) {
  std::error_code failure;
  const std::uintmax_t size = std::filesystem::file_size(path, failure);
  if (failure) {
    const bool absent = failure == std::errc::no_such_file_or_directory;
    return make_error(absent ? ErrorCode::not_found : ErrorCode::io,
                      fmt::format("{}: {}", path.string(), failure.message()), "script");
  }
  if (size > limits.max_file_bytes) {
    return make_error(ErrorCode::resource_exhausted,
                      fmt::format("found {} bytes, expected at most {}", size, limits.max_file_bytes),
                      path.string());
  }
  std::ifstream in(path, std::ios::binary);
  std::string text(static_cast<std::size_t>(size), '\0');
  in.read(text.data(), static_cast<std::streamsize>(size));
  if (!in) return make_error(ErrorCode::io, fmt::format("cannot read {}", path.string()), "script");
  return parse_shot_script(text, path.string(), limits);
}

}  // namespace handloft::client
