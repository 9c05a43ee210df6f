#include "server-model/session/script_expectation.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <initializer_list>
#include <optional>
#include <string>

#include "server-model/session/script_json.h"

namespace handloft::model {

using nlohmann::json;

namespace {

std::string words_of(const json& value) {
  constexpr std::size_t max_shown = 200;
  std::string text = value.dump(-1, ' ', false, json::error_handler_t::replace);
  // Cut at a character, not within one.
  if (text.size() > max_shown) {
    std::size_t end = max_shown;
    while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xc0U) == 0x80U) --end;
    text.resize(end);
    text += "...";
  }
  return text;
}

// Protobuf JSON writes 64-bit integers as strings; they count as numbers here.
std::optional<double> as_number(const json& value) {
  if (value.is_number()) return value.get<double>();
  if (!value.is_string()) return std::nullopt;
  const auto& text = value.get_ref<const std::string&>();
  double number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(number)) return std::nullopt;
  return number;
}

// Member by member and element by element; numbers within the tolerance, 0 for the same number.
bool alike(const json& found, const json& expected, double tolerance) {
  if (expected.is_object() && found.is_object()) {
    return expected.size() == found.size() &&
           std::all_of(expected.items().begin(), expected.items().end(), [&](const auto& item) {
             const auto other = found.find(item.key());
             return other != found.end() && alike(*other, item.value(), tolerance);
           });
  }
  if (expected.is_array() && found.is_array()) {
    return std::equal(expected.begin(), expected.end(), found.begin(), found.end(),
                      [&](const json& e, const json& f) { return alike(f, e, tolerance); });
  }
  if (expected.is_number()) {
    const auto number = as_number(found);
    return number && std::abs(*number - expected.get<double>()) <= tolerance;
  }
  return expected == found;
}

Error malformed(std::string message, std::string field) {
  return make_error(ErrorCode::invalid_argument, std::move(message), std::move(field));
}

// Accepts "atMost" and "at_most" alike.
json normalised(const json& expectation) {
  json result = json::object();
  for (const auto& [key, value] : expectation.items()) {
    const std::string name = key == "at_most"             ? "atMost"
                             : key == "at_least"          ? "atLeast"
                             : key == "equals_remembered" ? "equalsRemembered"
                                                          : key;
    result[name] = value;
  }
  return result;
}

Status only_members(const json& expectation, std::initializer_list<std::string_view> known) {
  for (const auto& [key, value] : expectation.items()) {
    if (std::find(known.begin(), known.end(), key) == known.end()) {
      return malformed(fmt::format("found the unknown field \"{}\"", key), "expect." + key);
    }
  }
  return {};
}

Result<handloft::v1::QueryResult> ask(const json& query, ScriptTarget& target) {
  handloft::v1::Query message;
  if (auto status = from_json(query.dump(), message); !status) {
    Error error = status.error();
    error.field = error.field.empty() ? "expect.query" : "expect.query." + error.field;
    return error;
  }
  return target.query(message);
}

Result<json> check_failure(const json& expectation, ScriptTarget& target) {
  if (auto status = only_members(expectation, {"fails", "code", "field"}); !status) return status.error();
  const json& what = expectation["fails"];
  if (!what.is_object())
    return malformed("found no object, expected an operation or a query", "expect.fails");
  for (const char* member : {"code", "field"}) {
    if (expectation.contains(member) && !expectation[member].is_string()) {
      return malformed(fmt::format("found {}, expected a string", words_of(expectation[member])),
                       fmt::format("expect.{}", member));
    }
  }
  std::optional<Error> failure;
  if (what.size() == 1 && what.contains("query")) {
    auto answered = ask(what["query"], target);
    if (!answered) failure = answered.error();
  } else {
    handloft::v1::Operation operation;
    auto parsed = from_json(what.dump(), operation);
    if (!parsed) {
      failure = parsed.error();
    } else {
      auto submitted = target.submit(operation);
      if (!submitted) failure = submitted.error();
    }
  }
  if (!failure)
    return make_error(ErrorCode::failed_precondition, "it succeeded, expected a failure", "expect.fails");
  const std::string code(to_string(failure->code));
  const std::string wanted_code = expectation.value("code", code);
  const std::string wanted_field = expectation.value("field", failure->field);
  if (code != wanted_code) {
    return make_error(
        ErrorCode::failed_precondition,
        fmt::format("found the code {} ({}), expected {}", code, failure->describe(), wanted_code),
        "expect.code");
  }
  if (failure->field != wanted_field) {
    return make_error(ErrorCode::failed_precondition,
                      fmt::format("found the field \"{}\", expected \"{}\"", failure->field, wanted_field),
                      "expect.field");
  }
  return json{{"code", code}, {"field", failure->field}, {"message", failure->message}};
}

Result<double> number_member(const json& expectation, const char* name) {
  const json& value = expectation[name];
  if (!value.is_number() || !std::isfinite(value.get<double>())) {
    return malformed(fmt::format("found {}, expected a number", words_of(value)),
                     fmt::format("expect.{}", name));
  }
  return value.get<double>();
}

// All comparisons that the expectation asks for; the first that does not hold is the error.
Status compare(const json& found, const json& expectation, const std::string& path) {
  const auto differs = [&](const std::string& expected) {
    return make_error(ErrorCode::failed_precondition,
                      fmt::format("found {}, expected {}", words_of(found), expected), path);
  };
  if (expectation.contains("equals") && !alike(found, expectation["equals"], 0.0)) {
    return differs(words_of(expectation["equals"]));
  }
  if (expectation.contains("near")) {
    if (!expectation.contains("tolerance"))
      return malformed("found none, expected a number", "expect.tolerance");
    auto tolerance = number_member(expectation, "tolerance");
    if (!tolerance) return tolerance.error();
    if (!alike(found, expectation["near"], *tolerance)) {
      return differs(fmt::format("{} within {}", words_of(expectation["near"]), *tolerance));
    }
  } else if (expectation.contains("tolerance")) {
    return malformed("found a tolerance without \"near\"", "expect.tolerance");
  }
  for (const char* bound : {"atMost", "atLeast"}) {
    if (!expectation.contains(bound)) continue;
    auto limit = number_member(expectation, bound);
    if (!limit) return limit.error();
    const bool most = std::string_view(bound) == "atMost";
    const auto number = as_number(found);
    if (!number || (most ? *number > *limit : *number < *limit)) {
      return differs(fmt::format("{} {}", most ? "at most" : "at least", *limit));
    }
  }
  if (expectation.contains("count")) {
    auto count = number_member(expectation, "count");
    if (!count) return count.error();
    if (!found.is_array() || static_cast<double>(found.size()) != *count) {
      return make_error(
          ErrorCode::failed_precondition,
          found.is_array() ? fmt::format("found {} elements, expected {}", found.size(), *count)
                           : fmt::format("found {}, expected a list of {} elements", words_of(found), *count),
          path);
    }
  }
  return {};
}

// A name under which a value is or was remembered.
Result<std::string> name_member(const json& expectation, const char* member) {
  const json& value = expectation[member];
  if (value.is_string() && !value.get_ref<const std::string&>().empty()) return value.get<std::string>();
  return malformed(fmt::format("found {}, expected a name", words_of(value)),
                   fmt::format("expect.{}", member));
}

Status compare_remembered(const json& found, const json& expectation, const std::string& path,
                          const Remembered& remembered) {
  if (!expectation.contains("equalsRemembered")) return {};
  auto name = name_member(expectation, "equalsRemembered");
  if (!name) return name.error();
  const auto value = remembered.find(*name);
  if (value == remembered.end()) {
    return malformed(fmt::format("found \"{}\", which no line before has remembered", *name),
                     "expect.equalsRemembered");
  }
  if (found == value->second) return {};
  return make_error(ErrorCode::failed_precondition,
                    fmt::format("found {}, expected {} as remembered by \"{}\"", words_of(found),
                                words_of(value->second), *name),
                    path);
}

Result<json> check_answer(const json& expectation, ScriptTarget& target, Remembered& remembered) {
  if (auto status = only_members(expectation, {"query", "path", "equals", "near", "tolerance", "atMost",
                                               "atLeast", "count", "remember", "equalsRemembered"});
      !status) {
    return status.error();
  }
  const bool compares =
      std::any_of(expectation.items().begin(), expectation.items().end(), [](const auto& item) {
        return item.key() != "query" && item.key() != "path" && item.key() != "tolerance";
      });
  if (!compares) {
    return malformed(
        "found nothing to compare with, expected equals, near, atMost, atLeast, count, remember or "
        "equalsRemembered",
        "expect");
  }
  if (expectation.contains("path") && !expectation["path"].is_string()) {
    return malformed(fmt::format("found {}, expected a string", words_of(expectation["path"])),
                     "expect.path");
  }
  auto answered = ask(expectation["query"], target);
  if (!answered) return answered.error();
  auto text = to_json(*answered);
  if (!text) return text.error();
  auto parsed = parse_json(*text);
  if (!parsed) return parsed.error();
  const std::string path = expectation.value("path", std::string());
  const json* found = find_path(*parsed, path);
  if (found == nullptr) {
    return make_error(ErrorCode::failed_precondition, "found nothing there, expected a value", path);
  }
  if (auto status = compare(*found, expectation, path); !status) return status.error();
  if (auto status = compare_remembered(*found, expectation, path, remembered); !status) return status.error();
  if (expectation.contains("remember")) {
    auto name = name_member(expectation, "remember");
    if (!name) return name.error();
    remembered[*name] = *found;
  }
  return *found;
}

}  // namespace

Result<json> check_expectation(const json& expectation, ScriptTarget& target, Remembered& remembered) {
  if (!expectation.is_object()) return malformed("found no object, expected one", "expect");
  const json members = normalised(expectation);
  if (members.contains("fails")) return check_failure(members, target);
  if (members.contains("query")) return check_answer(members, target, remembered);
  return malformed("found neither \"query\" nor \"fails\", expected one", "expect");
}

}  // namespace handloft::model
