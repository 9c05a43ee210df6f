#include "server-model/session/script_runner.h"

#include <fmt/format.h>

#include <algorithm>
#include <istream>
#include <nlohmann/json.hpp>
#include <optional>
#include <ostream>

#include "server-model/session/script_expectation.h"
#include "server-model/session/script_json.h"

namespace handloft::model {

using nlohmann::json;

namespace {

/// Some editors begin a file with it; it means nothing in UTF-8.
constexpr std::string_view byte_order_mark = "\xef\xbb\xbf";

enum class Read { line, too_long, end };

// One line without its end; of a line that is too long only the length is looked at.
Read read_line(std::istream& in, std::string& line, std::size_t max_bytes) {
  line.clear();
  bool any = false;
  bool too_long = false;
  std::streambuf& buffer = *in.rdbuf();
  for (int c = buffer.sbumpc(); c != std::char_traits<char>::eof(); c = buffer.sbumpc()) {
    any = true;
    if (c == '\n') break;
    if (line.size() < max_bytes) {
      line.push_back(static_cast<char>(c));
    } else {
      too_long = true;
    }
  }
  if (!any) return Read::end;
  if (!line.empty() && line.back() == '\r') line.pop_back();
  return too_long ? Read::too_long : Read::line;
}

bool is_nothing(std::string_view line) {
  const std::size_t start = line.find_first_not_of(" \t");
  if (start == std::string_view::npos) return true;
  line.remove_prefix(start);
  return line.front() == '#' || line.starts_with("//");
}

std::string dump(const json& value) {
  return value.dump(-1, ' ', false, json::error_handler_t::replace);
}

// The "result" of the answer line.
Result<std::string> answer_line(std::string_view line, ScriptTarget& target, Remembered& remembered) {
  auto members = top_level_members(line);
  if (!members) return members.error();
  const auto has = [&](std::string_view name) {
    return std::find(members->begin(), members->end(), name) != members->end();
  };
  if ((has("query") || has("expect")) && members->size() > 1) {
    return make_error(ErrorCode::invalid_argument, "found other members beside it, expected none",
                      has("query") ? "query" : "expect");
  }
  if (has("query")) {
    auto parsed = parse_json(line);
    if (!parsed) return parsed.error();
    handloft::v1::Query query;
    if (auto status = from_json(dump((*parsed)["query"]), query); !status) {
      Error error = status.error();
      error.field = error.field.empty() ? "query" : "query." + error.field;
      return error;
    }
    auto result = target.query(query);
    if (!result) return result.error();
    return to_json(*result);
  }
  if (has("expect")) {
    auto parsed = parse_json(line);
    if (!parsed) return parsed.error();
    auto found = check_expectation((*parsed)["expect"], target, remembered);
    if (!found) return found.error();
    return dump(*found);
  }
  handloft::v1::Operation operation;
  if (auto status = from_json(line, operation); !status) return status.error();
  // Two lines with one number would be taken for one operation that is sent again.
  if (operation.client_op_id() != 0) {
    return make_error(
        ErrorCode::invalid_argument,
        fmt::format("found {}, expected none: no line of a script is sent twice", operation.client_op_id()),
        "clientOpId");
  }
  auto outcome = target.submit(operation);
  if (!outcome) return outcome.error();
  nlohmann::ordered_json result;
  result["sequence"] = outcome->sequence;
  result["entities"] = outcome->entities;
  if (!outcome->notes.empty()) result["notes"] = outcome->notes;
  return result.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

Result<std::string> answer_safely(Read read, const std::string& line, ScriptTarget& target,
                                  Remembered& remembered, const ScriptOptions& options) {
  if (read == Read::too_long) {
    return make_error(ErrorCode::resource_exhausted,
                      fmt::format("found a line of more than {} bytes", options.max_line_bytes));
  }
  try {
    return answer_line(line, target, remembered);
  } catch (const std::exception& problem) {  // Of the JSON libraries: out of memory, say.
    return make_error(ErrorCode::internal, problem.what());
  }
}

std::string failure_json(const Error& error) {
  nlohmann::ordered_json json;
  json["code"] = std::string(to_string(error.code));
  json["field"] = error.field;
  json["message"] = error.message;
  return json.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

}  // namespace

ScriptSummary run_script(std::istream& in, std::ostream& out, ScriptTarget& target,
                         const ScriptOptions& options) {
  ScriptSummary summary;
  Remembered remembered;
  std::string line;
  for (std::size_t number = 1;; ++number) {
    const Read read = read_line(in, line, options.max_line_bytes);
    if (read == Read::end) break;
    if (number == 1 && line.starts_with(byte_order_mark)) line.erase(0, byte_order_mark.size());
    if (read == Read::line && is_nothing(line)) continue;
    ++summary.lines_run;
    const auto result = answer_safely(read, line, target, remembered, options);
    if (result) {
      out << "{\"line\":" << number << ",\"ok\":true,\"result\":" << *result << "}\n" << std::flush;
      continue;
    }
    out << "{\"line\":" << number << ",\"ok\":false,\"error\":" << failure_json(result.error()) << "}\n"
        << std::flush;
    ++summary.lines_failed;
    if (summary.first_failed_line == 0) {
      summary.first_failed_line = number;
      summary.first_failure = result.error().describe();
    }
    if (options.on_failure == ScriptOptions::OnFailure::stop) break;
  }
  return summary;
}

}  // namespace handloft::model
