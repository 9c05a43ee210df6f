#include "daemon-tracking/main/trace_log.h"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>

namespace handloft::tracking {

namespace {
constexpr double ns_per_us = 1000.0;

// Each camera is a process of its own in the picture, each of its stages a line.
void append_name(fmt::memory_buffer& out, const char* kind, std::size_t camera, std::size_t stage,
                 const std::string& name) {
  fmt::format_to(std::back_inserter(out),
                 R"({{"ph":"M","name":"{}","pid":{},"tid":{},"args":{{"name":{}}}}},)"
                 "\n",
                 kind, camera, stage,
                 nlohmann::json(name).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace));
}
}  // namespace

TraceLog::TraceLog(std::size_t capacity) : capacity_(std::max<std::size_t>(capacity, 1)) {}

void TraceLog::add(const TraceSpan& span) {
  const std::lock_guard lock(mutex_);
  if (spans_.size() < capacity_) {
    spans_.push_back(span);
  } else {
    spans_[static_cast<std::size_t>(added_ % capacity_)] = span;
  }
  ++added_;
}

std::uint64_t TraceLog::forgotten() const {
  const std::lock_guard lock(mutex_);
  return added_ - spans_.size();
}

std::string TraceLog::to_json(const std::vector<std::string>& cameras) const {
  std::vector<TraceSpan> spans;
  {
    const std::lock_guard lock(mutex_);
    spans = spans_;
  }
  std::stable_sort(spans.begin(), spans.end(),
                   [](const TraceSpan& a, const TraceSpan& b) { return a.begin < b.begin; });
  fmt::memory_buffer out;
  const auto to = std::back_inserter(out);
  fmt::format_to(to, "{{\"displayTimeUnit\":\"ms\",\"traceEvents\":[\n");
  for (std::size_t camera = 0; camera < cameras.size(); ++camera) {
    append_name(out, "process_name", camera, 0, "camera/" + cameras[camera]);
    for (std::size_t stage = 0; stage < trace_stage_names.size(); ++stage)
      append_name(out, "thread_name", camera, stage, trace_stage_names[stage]);
  }
  for (const TraceSpan& span : spans) {
    const auto stage = static_cast<std::size_t>(span.stage);
    fmt::format_to(
        to,
        R"({{"ph":"X","name":"{}","pid":{},"tid":{},"ts":{:.3f},"dur":{:.3f},"args":{{"frame":{}}}}},)"
        "\n",
        trace_stage_names[stage], span.camera, stage, static_cast<double>(to_ns(span.begin)) / ns_per_us,
        static_cast<double>(std::max(span.length, Duration{}).count()) / ns_per_us, span.frame);
  }
  // A last event without a comma behind it.
  fmt::format_to(to, R"({{"ph":"M","name":"trace_end","pid":0,"tid":0,"args":{{"name":"end"}}}})"
                     "\n]}}\n");
  return fmt::to_string(out);
}

Status TraceLog::write(const std::filesystem::path& path, const std::vector<std::string>& cameras) const {
  std::ofstream out(path, std::ios::trunc);
  out << to_json(cameras);
  out.close();
  if (!out)
    return make_error(ErrorCode::io, "can't write " + path.string() + ": " + std::strerror(errno), "trace");
  return {};
}

}  // namespace handloft::tracking
