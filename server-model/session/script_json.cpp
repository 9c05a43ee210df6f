#include "server-model/session/script_json.h"

#include <fmt/format.h>
#include <google/protobuf/util/json_util.h>

#include <algorithm>
#include <charconv>

namespace handloft::model {

using nlohmann::json;

namespace {

// Reads a document's shape and keeps nothing but the members of the outermost object.
class MemberReader final : public nlohmann::json_sax<json> {
 public:
  std::vector<std::string> members;
  std::string problem;

  bool null() override { return value(); }
  bool boolean(bool) override { return value(); }
  bool number_integer(number_integer_t) override { return value(); }
  bool number_unsigned(number_unsigned_t) override { return value(); }
  bool number_float(number_float_t, const string_t&) override { return value(); }
  bool string(string_t&) override { return value(); }
  bool binary(binary_t&) override { return value(); }
  bool start_object(std::size_t) override { return ++depth_ <= max_json_depth || too_deep(); }
  bool end_object() override {
    --depth_;
    return true;
  }
  bool start_array(std::size_t) override {
    if (depth_ == 0) return value();
    return ++depth_ <= max_json_depth || too_deep();
  }
  bool end_array() override {
    --depth_;
    return true;
  }
  bool key(string_t& name) override {
    if (depth_ != 1) return true;
    if (std::find(members.begin(), members.end(), name) != members.end()) {
      problem = fmt::format("found \"{}\" twice", name);
      return false;
    }
    members.push_back(name);
    return true;
  }
  bool parse_error(std::size_t position, const std::string&, const nlohmann::detail::exception&) override {
    problem = fmt::format("found no well-formed JSON at byte {}, expected one object in UTF-8", position);
    return false;
  }

 private:
  bool value() {
    if (depth_ > 0) return true;
    problem = "found a JSON value, expected an object";
    return false;
  }
  bool too_deep() {
    problem = fmt::format("found more than {} levels of nesting", max_json_depth);
    return false;
  }
  int depth_ = 0;
};

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

// protobuf: "(addPoints.points[1].position) foo: Cannot find field."
Error json_error(std::string_view message) {
  std::string where;
  std::string_view what = message;
  if (!what.empty() && what.front() == '(') {
    const std::size_t end = what.find(')');
    if (end != std::string_view::npos) {
      where = what.substr(1, end - 1);
      what.remove_prefix(std::min(what.size(), end + 2));
    }
  }
  constexpr std::string_view unknown = ": Cannot find field.";
  if (what.ends_with(unknown)) {
    const std::string name(what.substr(0, what.size() - unknown.size()));
    return make_error(ErrorCode::invalid_argument, fmt::format("found the unknown field \"{}\"", name),
                      where.empty() ? name : where + "." + name);
  }
  return make_error(ErrorCode::invalid_argument, std::string(what), where);
}

}  // namespace

Result<std::vector<std::string>> top_level_members(std::string_view text) {
  MemberReader reader;
  if (!json::sax_parse(text.begin(), text.end(), &reader)) {
    return make_error(ErrorCode::invalid_argument,
                      reader.problem.empty() ? std::string("found no well-formed JSON") : reader.problem);
  }
  return std::move(reader.members);
}

Result<json> parse_json(std::string_view text) {
  json parsed = json::parse(text.begin(), text.end(), nullptr, false);
  if (parsed.is_discarded()) return make_error(ErrorCode::invalid_argument, "found no well-formed JSON");
  return parsed;
}

Status from_json(std::string_view text, google::protobuf::Message& message) {
  google::protobuf::util::JsonParseOptions options;
  options.ignore_unknown_fields = false;
  const auto status = google::protobuf::util::JsonStringToMessage(
      google::protobuf::StringPiece(text.data(), text.size()), &message, options);
  if (!status.ok()) {
    const auto words = status.message();
    return json_error(std::string_view(words.data(), words.size()));
  }
  return {};
}

Result<std::string> to_json(const google::protobuf::Message& message) {
  google::protobuf::util::JsonPrintOptions options;
  options.always_print_primitive_fields = true;
  std::string text;
  const auto status = google::protobuf::util::MessageToJsonString(message, &text, options);
  if (!status.ok()) return make_error(ErrorCode::internal, status.ToString());
  return text;
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
