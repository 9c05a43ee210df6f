#include "tests/e2e/session.h"

#include <gtest/gtest.h>

#include <chrono>
#include <csignal>
#include <fstream>

#include "tests/support/process.h"

namespace handloft::e2e {
namespace {

using namespace std::chrono_literals;
namespace fs = std::filesystem;

json read_json(const fs::path& path) {
  std::ifstream in(path);
  return json::parse(in, nullptr, false);
}

std::string unix_endpoint(const fs::path& path) {
  return "unix:" + path.string();
}

}  // namespace

SessionResult run_session(const fs::path& folder, const SessionOptions& options, const std::string& script) {
  SessionResult result;
  const std::string tracking = unix_endpoint(folder / "t.sock");
  const std::string model = unix_endpoint(folder / "m.sock");
  std::vector<std::string> daemon = {test::program("handloft-trackd"),
                                     "--listen",
                                     tracking,
                                     "--exit-at-end",
                                     "--wait-for-subscribers",
                                     options.with_display ? "2" : "1",
                                     "--report",
                                     folder / "tracking.json"};
  daemon.insert(daemon.end(), options.source.begin(), options.source.end());
  if (options.record) daemon.insert(daemon.end(), {"--record", options.record->string()});
  test::Process trackd(daemon, folder / "trackd.log");
  test::Process modeld({test::program("handloft-modeld"), "serve", "--listen", model, "--tracking", tracking,
                        "--report", folder / "model.json"},
                       folder / "modeld.log");
  const std::optional<std::string> ready = modeld.read_line(30s);
  EXPECT_TRUE(ready) << modeld.error_output();
  std::optional<test::Process> hmd;
  if (options.with_display) {
    std::vector<std::string> viewer = {test::program("handloft-hmd"),
                                       "--model",
                                       model,
                                       "--tracking",
                                       tracking,
                                       "--offscreen",
                                       "--screenshot",
                                       folder / "view.png",
                                       "--screenshot-when",
                                       options.screenshot_when,
                                       "--report",
                                       folder / "view.json"};
    viewer.insert(viewer.end(), options.viewer.begin(), options.viewer.end());
    hmd.emplace(viewer, folder / "hmd.log");
  }
  EXPECT_EQ(trackd.wait(180s), 0) << trackd.error_output();
  if (hmd) {
    hmd->signal(SIGTERM);
    EXPECT_EQ(hmd->wait(60s), 0) << hmd->error_output();
    result.view = read_json(folder / "view.json");
  }
  std::ofstream(folder / "script.jsonl") << script;
  test::Process run({test::program("handloft-modeld"), "run", folder / "script.jsonl", "--connect", model,
                     "--output-dir", folder},
                    folder / "run.log");
  while (const std::optional<std::string> line = run.read_line(60s)) {
    result.answers.push_back(json::parse(*line, nullptr, false));
  }
  EXPECT_EQ(run.wait(30s), 0) << run.error_output();
  modeld.signal(SIGTERM);
  EXPECT_EQ(modeld.wait(30s), 0) << modeld.error_output();
  result.tracking = read_json(folder / "tracking.json");
  result.model = read_json(folder / "model.json");
  return result;
}

}  // namespace handloft::e2e
