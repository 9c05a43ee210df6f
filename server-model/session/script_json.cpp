#include "server-model/session/script_json.h"

#include <fmt/format.h>
#include <google/protobuf/util/json_util.h>

#include <charconv>
#include <set>

#include "server-model/session/script_fault.h"

namespace handloft::model {

using nlohmann::json;

namespace {

// Reads a document's shape; keeps the members of the outermost object, and of those within only the names on
// the way to where it is.
class MemberReader final : public nlohmann::json_sax<json> {
 public:
  std::vector<std::string> members;
  std::string problem;
  std::string field;

  bool null() override { return value(); }
  bool boolean(bool) override { return value(); }
  bool number_integer(number_integer_t) override { return value(); }
  bool number_unsigned(number_unsigned_t) override { return value(); }
  bool number_float(number_float_t, const string_t&) override { return value(); }
  bool string(string_t&) override { return value(); }
  bool binary(binary_t&) override { return value(); }
  bool start_object(std::size_t) override { return enter(false); }
  bool end_object() override { return leave(); }
  bool start_array(std::size_t) override { return within_.empty() ? value() : enter(true); }
  bool end_array() override { return leave(); }
  bool key(string_t& name) override {
    Level& level = within_.back();
    // Both spellings of a field are the same field.
    if (!level.names.insert(snake_case(name)).second) {
      problem = fmt::format("found \"{}\" twice", name);
      field = within_.size() > 1 ? path() + snake_case(name) : "";
      return false;
    }
    level.name = name;
    if (within_.size() == 1) members.push_back(name);
    return true;
  }
  bool parse_error(std::size_t position, const std::string&, const nlohmann::detail::exception&) override {
    problem = fmt::format("found no well-formed JSON at byte {}, expected one object in UTF-8", position);
    return false;
  }

 private:
  struct Level {
    bool is_array = false;
    std::size_t index = 0;        // of the element in an array
    std::string name;             // of the member in an object
    std::set<std::string> names;  // of the members so far
  };

  bool value() {
    if (!within_.empty()) return next_element();
    problem = "found a JSON value, expected an object";
    return false;
  }
  bool enter(bool is_array) {
    if (within_.size() >= max_json_depth) {
      problem = fmt::format("found more than {} levels of nesting", max_json_depth);
      return false;
    }
    within_.push_back({is_array, 0, {}, {}});
    return true;
  }
  bool leave() {
    within_.pop_back();
    return next_element();
  }
  bool next_element() {
    if (!within_.empty() && within_.back().is_array) ++within_.back().index;
    return true;
  }
  // "add_points.points[3]." of the object that is being read.
  std::string path() const {
    std::string result;
    for (std::size_t i = 0; i + 1 < within_.size(); ++i) {
      const Level& level = within_[i];
      if (level.is_array) {
        result += fmt::format("[{}]", level.index);
      } else {
        result += (i == 0 ? "" : ".") + snake_case(level.name);
      }
    }
    return result + ".";
  }
  std::vector<Level> within_;
};

// The ends of all numbers "-0". Protobuf writes the double so, and reads it as a whole number, which has no
// sign; so does the other library.
std::vector<std::size_t> ends_of_negative_zeros(std::string_view text) {
  const auto is_one_of = [](char c, std::string_view characters) {
    return characters.find(c) != std::string_view::npos;
  };
  std::vector<std::size_t> ends;
  bool in_text = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (c == '"') {
      in_text = !in_text;
    } else if (in_text) {
      if (c == '\\') ++i;
    } else if (c == '-' && text.substr(i + 1).starts_with('0') && (i == 0 || !is_one_of(text[i - 1], "eE"))) {
      // Behind an "e" it is an exponent; before "." or "e" the number goes on.
      const std::size_t end = i + 2;
      if (end == text.size() || is_one_of(text[end], ",]} \t\r\n")) ends.push_back(end);
    }
  }
  return ends;
}

// With "-0.0" in their place, which is the same number of JSON. `changed` holds the text if it is another.
std::string_view with_signed_zeros(std::string_view text, std::string& changed) {
  const std::vector<std::size_t> ends = ends_of_negative_zeros(text);
  if (ends.empty()) return text;
  constexpr std::string_view rest = ".0";
  changed.reserve(text.size() + rest.size() * ends.size());
  std::size_t begin = 0;
  for (const std::size_t end : ends) {
    changed.append(text.substr(begin, end - begin)).append(rest);
    begin = end;
  }
  return changed.append(text.substr(begin));
}

std::string camel_case(std::string_view name) {
  std::string result;
  bool upper = false;
  for (const char c : name) {
    if (c == '_') {
      upper = true;
      continue;
    }
    result.push_back(upper && c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c);
    upper = false;
  }
  return result;
}

const json* step_into(const json& at, const std::string& name) {
  if (at.is_array()) {
    std::size_t index = 0;
    const auto [end, error] = std::from_chars(name.data(), name.data() + name.size(), index);
    const bool whole = error == std::errc() && end == name.data() + name.size();
    return whole && index < at.size() ? &at[index] : nullptr;
  }
  if (!at.is_object()) return nullptr;
  for (const std::string& spelling : {name, camel_case(name)}) {
    if (const auto found = at.find(spelling); found != at.end()) return &*found;
  }
  return nullptr;
}

}  // namespace

Result<std::vector<std::string>> top_level_members(std::string_view text) {
  MemberReader reader;
  if (!json::sax_parse(text.begin(), text.end(), &reader)) {
    return make_error(ErrorCode::invalid_argument,
                      reader.problem.empty() ? std::string("found no well-formed JSON") : reader.problem,
                      reader.field);
  }
  return std::move(reader.members);
}

Result<json> parse_json(std::string_view line) {
  std::string changed;
  const std::string_view text = with_signed_zeros(line, changed);
  json parsed = json::parse(text.begin(), text.end(), nullptr, false);
  if (parsed.is_discarded()) return make_error(ErrorCode::invalid_argument, "found no well-formed JSON");
  return parsed;
}

Status from_json(std::string_view line, google::protobuf::Message& message) {
  std::string changed;
  const std::string_view text = with_signed_zeros(line, changed);
  google::protobuf::util::JsonParseOptions options;
  options.ignore_unknown_fields = false;
  const auto status = google::protobuf::util::JsonStringToMessage(
      google::protobuf::StringPiece(text.data(), text.size()), &message, options);
  if (status.ok()) return {};
  const json parsed = json::parse(text.begin(), text.end(), nullptr, false);
  if (!parsed.is_discarded()) {
    if (auto fault = find_fault(parsed, *message.GetDescriptor())) return *std::move(fault);
  }
  return make_error(ErrorCode::invalid_argument,
                    fmt::format("found JSON that is not the message {}, expected its fields as documented",
                                message.GetDescriptor()->name()));
}

Result<std::string> to_json(const google::protobuf::Message& message) {
  google::protobuf::util::JsonPrintOptions options;
  options.always_print_primitive_fields = true;
  std::string text;
  const auto status = google::protobuf::util::MessageToJsonString(message, &text, options);
  if (!status.ok()) return make_error(ErrorCode::internal, status.ToString());
  std::string changed;
  with_signed_zeros(text, changed);
  return changed.empty() ? text : changed;
}

const json* find_path(const json& whole, std::string_view path) {
  const json* at = &whole;
  if (path.empty()) return at;
  const char separator = path.front() == '/' ? '/' : '.';
  if (separator == '/') path.remove_prefix(1);
  while (at != nullptr) {
    const std::size_t end = path.find(separator);
    at = step_into(*at, std::string(path.substr(0, end)));
    if (end == std::string_view::npos) break;
    path.remove_prefix(end + 1);
  }
  return at;
}

}  // namespace handloft::model
