// Prometheus' text format: every line is a comment or a sample, every family has help and type once.

#include "daemon-tracking/main/metrics.h"

#include <gtest/gtest.h>

#include <regex>
#include <set>
#include <sstream>

namespace handloft::tracking {
namespace {

MetricsSnapshot some_figures() {
  MetricsSnapshot figures;
  DeviceReport glove;
  glove.device = "glove";
  glove.present = true;
  glove.rate_hz = 249.5;
  glove.samples = 1000;
  glove.problem = "9 of 250 reports were lost";
  DeviceReport odd;
  odd.device = "camera/\"odd\\\n";
  figures.devices = {glove, odd};
  figures.cameras.resize(1);
  figures.cameras[0].name = "left";
  figures.cameras[0].frames = 77;
  figures.cameras[0].vision.add(3.0);
  figures.exposure_to_publish.add(25.0);
  figures.published = 123;
  return figures;
}

TEST(Metrics, EveryLineIsWellFormed) {
  MetricsBoard board;
  board.put(some_figures());
  const std::regex comment(R"(# (HELP|TYPE) handloft_[a-z_]+ .+)");
  const std::regex sample(
      R"(handloft_[a-z_]+(\{[a-z]+="([^"\\]|\\["\\n])*"(,[a-z]+="([^"\\]|\\["\\n])*")*\})? -?[0-9.e+-]+)");
  std::istringstream lines(prometheus_text(board, process_figures()));
  std::set<std::string> families;
  int samples = 0;
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("#")) {
      EXPECT_TRUE(std::regex_match(line, comment)) << line;
      if (line.starts_with("# TYPE")) {
        const std::string family = line.substr(7, line.find(' ', 7) - 7);
        EXPECT_TRUE(families.insert(family).second) << family << " has its type twice";
      }
    } else {
      EXPECT_TRUE(std::regex_match(line, sample)) << line;
      ++samples;
    }
  }
  EXPECT_GT(samples, 60);
}

TEST(Metrics, TheFiguresAreThere) {
  MetricsBoard board;
  board.put(some_figures());
  board.note_reload(true);
  board.note_reload(false);
  board.note_reload(false);
  const std::string text = prometheus_text(board, {1.5, 4096, 12, 2048});
  for (const char* line :
       {"handloft_device_rate_hz{device=\"glove\"} 249.5", "handloft_device_alarm{device=\"glove\"} 1",
        "handloft_device_alarm{device=\"camera/\\\"odd\\\\\\n\"} 0",
        "handloft_camera_frames_total{camera=\"left\"} 77",
        "handloft_camera_vision_seconds_bucket{camera=\"left\",le=\"0.002\"} 0",
        "handloft_camera_vision_seconds_bucket{camera=\"left\",le=\"0.004\"} 1",
        "handloft_exposure_to_publish_seconds_bucket{le=\"+Inf\"} 1",
        "handloft_exposure_to_publish_seconds_sum 0.025", "handloft_frames_published_total 123",
        "handloft_reloads_total 1", "handloft_reloads_refused_total 2",
        "handloft_process_resident_memory_bytes 4096", "handloft_process_heap_bytes 2048",
        "handloft_process_cpu_seconds_total 1.5"}) {
    EXPECT_NE(text.find(std::string(line) + "\n"), std::string::npos) << line << "\nin\n" << text;
  }
}

}  // namespace
}  // namespace handloft::tracking
