#include "server-model/session/script_fault.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <google/protobuf/descriptor.h>

#include <charconv>
#include <cmath>
#include <limits>
#include <map>
#include <string>
#include <vector>

namespace handloft::model {

using google::protobuf::Descriptor;
using google::protobuf::FieldDescriptor;
using nlohmann::json;

namespace {

using Fault = std::optional<Error>;

Fault fault(const json& found, const std::string& expected, const std::string& where) {
  constexpr std::size_t max_shown = 60;
  std::string words = found.is_object() ? "an object" : found.is_array() ? "a list" : "";
  if (words.empty())
    words = found.dump(-1, ' ', true, json::error_handler_t::replace);  // ASCII: cut anywhere
  if (words.size() > max_shown) words = words.substr(0, max_shown) + "...";
  return make_error(ErrorCode::invalid_argument, fmt::format("found {}, expected {}", words, expected),
                    where);
}

// Protobuf JSON takes numbers in quotes as well.
std::optional<double> number_in(const json& value) {
  if (value.is_number()) return value.get<double>();
  if (!value.is_string()) return std::nullopt;
  const auto& text = value.get_ref<const std::string&>();
  double number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return number;
}

// As wide as 64 bits need: a double would round the largest.
template <typename Whole>
bool fits(const json& value) {
  if (value.is_string()) {
    const auto& text = value.get_ref<const std::string&>();
    Whole whole{};
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), whole);
    return error == std::errc() && end == text.data() + text.size();
  }
  if (value.is_number_unsigned()) return std::in_range<Whole>(value.get<std::uint64_t>());
  if (value.is_number_integer()) return std::in_range<Whole>(value.get<std::int64_t>());
  const auto number = number_in(value);
  if (!number || std::trunc(*number) != *number) return false;
  return *number >= static_cast<double>(std::numeric_limits<Whole>::min()) &&
         *number < std::ldexp(1.0, std::numeric_limits<Whole>::digits);
}

template <typename Whole>
Fault whole_fault(const json& value, const std::string& where) {
  if (fits<Whole>(value)) return std::nullopt;
  return fault(value,
               fmt::format("a whole number from {} to {}", std::numeric_limits<Whole>::min(),
                           std::numeric_limits<Whole>::max()),
               where);
}

Fault enum_fault(const json& value, const FieldDescriptor& field, const std::string& where) {
  const auto& type = *field.enum_type();
  if (value.is_number_integer() && fits<std::int32_t>(value)) return std::nullopt;
  if (value.is_string() && type.FindValueByName(value.get<std::string>()) != nullptr) return std::nullopt;
  std::vector<std::string> names;
  for (int i = 0; i < type.value_count(); ++i) names.push_back(type.value(i)->name());
  return fault(value, fmt::format("{}", fmt::join(names, ", ")), where);
}

Fault single_fault(const json& value, const FieldDescriptor& field, const std::string& where);

Fault message_fault(const json& value, const Descriptor& type, const std::string& where) {
  if (!value.is_object()) return fault(value, "an object", where);
  const std::string prefix = where.empty() ? "" : where + ".";
  std::map<const google::protobuf::OneofDescriptor*, std::string> chosen;
  for (const auto& [name, member] : value.items()) {
    const FieldDescriptor* field = type.FindFieldByName(name);
    if (field == nullptr) field = type.FindFieldByCamelcaseName(name);
    if (field == nullptr) {
      return make_error(ErrorCode::invalid_argument, fmt::format("found the unknown field \"{}\"", name),
                        prefix + name);
    }
    if (member.is_null()) continue;  // as if left out
    const std::string at = prefix + field->name();
    if (const auto* oneof = field->real_containing_oneof(); oneof != nullptr) {
      if (const auto [other, first] = chosen.emplace(oneof, name); !first) {
        return make_error(
            ErrorCode::invalid_argument,
            fmt::format("found \"{}\" beside \"{}\", expected one of them", name, other->second), at);
      }
    }
    if (!field->is_repeated()) {
      if (auto found = single_fault(member, *field, at)) return found;
      continue;
    }
    if (!member.is_array()) return fault(member, "a list", at);
    for (std::size_t i = 0; i < member.size(); ++i) {
      if (auto found = single_fault(member[i], *field, fmt::format("{}[{}]", at, i))) return found;
    }
  }
  return std::nullopt;
}

Fault single_fault(const json& value, const FieldDescriptor& field, const std::string& where) {
  switch (field.cpp_type()) {
    case FieldDescriptor::CPPTYPE_MESSAGE:
      return message_fault(value, *field.message_type(), where);
    case FieldDescriptor::CPPTYPE_ENUM:
      return enum_fault(value, field, where);
    case FieldDescriptor::CPPTYPE_INT32:
      return whole_fault<std::int32_t>(value, where);
    case FieldDescriptor::CPPTYPE_UINT32:
      return whole_fault<std::uint32_t>(value, where);
    case FieldDescriptor::CPPTYPE_INT64:
      return whole_fault<std::int64_t>(value, where);
    case FieldDescriptor::CPPTYPE_UINT64:
      return whole_fault<std::uint64_t>(value, where);
    case FieldDescriptor::CPPTYPE_DOUBLE:
    case FieldDescriptor::CPPTYPE_FLOAT: {
      const auto number = number_in(value);
      if (number && std::isfinite(*number)) return std::nullopt;
      return fault(value, "a number", where);
    }
    case FieldDescriptor::CPPTYPE_BOOL:
      if (value.is_boolean()) return std::nullopt;
      return fault(value, "true or false", where);
    case FieldDescriptor::CPPTYPE_STRING:
      if (value.is_string() && field.type() == FieldDescriptor::TYPE_STRING) return std::nullopt;
      return fault(value, field.type() == FieldDescriptor::TYPE_BYTES ? "bytes in base64" : "text in quotes",
                   where);
  }
  return std::nullopt;
}

}  // namespace

std::optional<Error> find_fault(const json& value, const Descriptor& type) {
  return message_fault(value, type, "");
}

std::string snake_case(std::string_view name) {
  std::string result;
  for (const char c : name) {
    if (c >= 'A' && c <= 'Z') {
      if (!result.empty()) result.push_back('_');
      result.push_back(static_cast<char>(c - 'A' + 'a'));
    } else {
      result.push_back(c);
    }
  }
  return result;
}

}  // namespace handloft::model
