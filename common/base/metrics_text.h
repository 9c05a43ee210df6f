#pragma once
// A program's figures in Prometheus' text format 0.0.4 (exposition format), all under "handloft_": families
// of samples, each with its help and type once, as the format demands.

#include <fmt/format.h>

#include <iterator>
#include <string>
#include <string_view>

namespace handloft {

/// A label's value between its quotes: backslash, quote and newline escaped.
std::string escape_label(std::string_view text);
/// key="value", escaped.
std::string metrics_label(std::string_view key, std::string_view value);

class MetricsText {
 public:
  /// Begins a family; `name` must live until the next one begins. `type`: "counter", "gauge", "histogram",
  /// "summary".
  void family(std::string_view name, std::string_view type, std::string_view help) {
    name_ = name;
    fmt::format_to(to(), "# HELP handloft_{} {}\n# TYPE handloft_{} {}\n", name, help, name, type);
  }
  /// A sample of the family; `labels` without their braces, `suffix` as "_sum".
  template <typename Number>
  void sample(Number value, std::string_view labels = {}, std::string_view suffix = {}) {
    const std::string braced = labels.empty() ? std::string() : fmt::format("{{{}}}", labels);
    fmt::format_to(to(), "handloft_{}{}{} {}\n", name_, suffix, braced, value);
  }
  std::string take() const { return fmt::to_string(out_); }

 private:
  std::back_insert_iterator<fmt::memory_buffer> to() { return std::back_inserter(out_); }
  fmt::memory_buffer out_;
  std::string_view name_;
};

}  // namespace handloft
