#pragma once
// The figures of a session, as JSON for tools and in a few words for the log.

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "daemon-tracking/fusion/tracking_pipeline.h"
#include "daemon-tracking/main/accuracy_meter.h"
#include "daemon-tracking/main/percentiles.h"

namespace handloft::tracking {

struct CameraFigures {
  std::string name;
  std::uint64_t frames = 0;
  std::uint64_t dropped = 0;  ///< Replaced by a newer frame before the vision came to it.
  std::uint64_t missing = 0;  ///< Counted by the camera, but never delivered.
  std::uint64_t tags = 0;
  std::uint64_t fingertips = 0;
  Percentiles vision_ms;
};

struct SessionFigures {
  std::map<std::string, std::string> source;
  std::vector<CameraFigures> cameras;
  std::uint64_t glove_reports = 0;
  std::uint64_t published = 0;
  std::uint64_t missed_by_subscribers = 0;
  std::uint64_t recorded_samples = 0;
  std::string problem;  ///< What went wrong without ending the session, in words; empty: nothing.
  Accuracy accuracy;
  PipelineHealth health;
  Percentiles capture_to_publish_ms;  ///< Exposure to socket; real time only.
  Percentiles arrival_to_publish_ms;  ///< Our own part of it (T15).
};

std::string to_json(const SessionFigures& figures);
Status write_report(const SessionFigures& figures, const std::filesystem::path& path);

}  // namespace handloft::tracking
