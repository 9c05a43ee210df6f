#pragma once
// One session of the three programs as real processes.

#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

namespace handloft::e2e {

using nlohmann::json;

struct SessionOptions {
  std::vector<std::string> source;  // Of the tracking daemon.
  std::optional<std::filesystem::path> record;
  bool with_display = false;
  /// Of the viewer: when it takes its picture, "end" or when so many seconds are over.
  std::string screenshot_when = "end";
  std::vector<std::string> viewer = {"--size", "640x480", "--frame-rate", "8", "--camera", "head"};
};

struct SessionResult {
  json tracking, model, view;
  std::vector<json> answers;  // One a line of the script.
};

/// Runs one session to its end, then `script` against the server while it still holds the model. Files land
/// in `folder`: view.png, and the logs.
SessionResult run_session(const std::filesystem::path& folder, const SessionOptions& options,
                          const std::string& script);

}  // namespace handloft::e2e
