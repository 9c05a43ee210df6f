// The examples of proto/SCRIPT.md, the mouse script and the program's exit codes, through the program itself
// (U7).

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "tests/support/process.h"
#include "tests/support/test_data.h"

namespace handloft::model {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
constexpr std::chrono::seconds patience{60};

struct ScriptRun {
  int status = -1;
  std::vector<json> answers;
  std::string errors;
};

class ScriptProgram : public ::testing::Test {
 protected:
  ScriptRun run(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), test::program("handloft-modeld").string());
    test::Process process(arguments, folder_.path() / "errors");
    ScriptRun result;
    std::istringstream lines(process.read_all(patience));
    for (std::string line; std::getline(lines, line);) {
      result.answers.push_back(json::parse(line, nullptr, false));
      EXPECT_FALSE(result.answers.back().is_discarded()) << line;
    }
    result.status = process.wait(patience).value_or(-1);
    result.errors = process.error_output();
    return result;
  }
  std::string write(const std::string& name, const std::string& text) {
    std::ofstream(folder_.path() / name) << text;
    return (folder_.path() / name).string();
  }
  std::string output() const { return (folder_.path() / "out").string(); }

  test::TemporaryDirectory folder_;
};

// All blocks marked ```jsonl, one after the other.
std::string examples_of(const fs::path& document) {
  std::ifstream file(document);
  std::string script;
  bool inside = false;
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with("```")) {
      inside = line == "```jsonl";
    } else if (inside) {
      script += line + "\n";
    }
  }
  return script;
}

TEST_F(ScriptProgram, EveryExampleOfTheDocumentationHolds) {
  const std::string script = examples_of("proto/SCRIPT.md");
  ASSERT_FALSE(script.empty());
  const ScriptRun result = run({"run", write("examples.jsonl", script), "--output-dir", output()});
  EXPECT_EQ(result.status, 0) << result.errors;
  ASSERT_EQ(result.answers.size(), static_cast<std::size_t>(std::count(script.begin(), script.end(), '\n')));
  for (const json& answer : result.answers) EXPECT_TRUE(answer["ok"].get<bool>()) << answer;
  for (const char* name : {"shell.step", "shell.glb", "untrimmed.obj"})
    EXPECT_TRUE(fs::exists(fs::path(output()) / name));
  // Every operation and query of the protocol has an example.
  for (const char* name : {"createDualShape",
                           "addPoints",
                           "setSymmetry",
                           "fit",
                           "refitPlane",
                           "setSuperellipse",
                           "setRepresentation",
                           "rename",
                           "importStrokes",
                           "delete",
                           "undo",
                           "redo",
                           "export",
                           "surface",
                           "evaluate",
                           "points",
                           "entities",
                           "hash",
                           "history",
                           "createSculptSurface",
                           "setSculpting",
                           "addIcon",
                           "changeIcon",
                           "dragIcon",
                           "deleteIcon",
                           "commitSculpting",
                           "recoverSculpting",
                           "refineSurface",
                           "importModel",
                           "sculpt"}) {
    EXPECT_NE(script.find("{\"" + std::string(name) + "\": "), std::string::npos) << name;
  }
}

TEST_F(ScriptProgram, TheMouseIsDesignedTheSameTwice) {
  std::vector<json> hashes;
  for (int i = 0; i < 2; ++i) {
    const ScriptRun result = run({"run", "tests/data/mouse.jsonl", "--output-dir", output()});
    ASSERT_EQ(result.status, 0) << result.errors;
    EXPECT_TRUE(fs::exists(fs::path(output()) / "mouse.step"));
    EXPECT_TRUE(fs::exists(fs::path(output()) / "mouse.glb"));
    hashes.push_back(result.answers.back()["result"]["hash"]["sha256"]);
  }
  EXPECT_EQ(hashes[0], hashes[1]);
}

TEST_F(ScriptProgram, AFailedLineIsNamedAndGivesStatusOne) {
  const std::string script =
      write("bad.jsonl", "{\"createDualShape\":{}}\n# two\n{\"fit\":{\"entity\":\"x\"}}\n{\"undo\":{}}\n");
  const ScriptRun stopped = run({"run", script});
  EXPECT_EQ(stopped.status, 1);
  EXPECT_EQ(stopped.answers.size(), 2U);
  EXPECT_NE(stopped.errors.find("line 3: not_found: fit.entity"), std::string::npos) << stopped.errors;
  const ScriptRun all = run({"run", script, "--keep-going"});
  EXPECT_EQ(all.status, 1);
  EXPECT_EQ(all.answers.size(), 3U);
}

TEST_F(ScriptProgram, WrongUsageGivesStatusTwoAndNoAnswers) {
  for (const std::vector<std::string>& arguments :
       {std::vector<std::string>{},
        {"dance"},
        {"run"},
        {"run", "no-such-file"},
        {"run", folder_.path().string()},
        {"run", "a", "--bogus"},
        {"run", write("empty", ""), "--connect", "unix:" + folder_.path().string() + "/none"}}) {
    const ScriptRun result = run(arguments);
    EXPECT_EQ(result.status, 2) << (arguments.empty() ? "" : arguments.back());
    EXPECT_TRUE(result.answers.empty());
    EXPECT_FALSE(result.errors.empty());
  }
}

// Who lost --connect would else believe that a server has the lines.
TEST_F(ScriptProgram, WhatNeedsAServerIsRefusedWithoutOneByName) {
  const std::string script = write("one.jsonl", "{\"createDualShape\":{}}\n");
  const std::string config = write("run.toml", "save = \"durable\"\n");
  const std::pair<std::vector<std::string>, std::string> cases[] = {
      {{"--save", "durable"}, "--save: found it without --connect"},
      {{"--save", "configured"}, "--save: "},
      {{"--config", config}, "--save: "},
      {{"--model", "foo"}, "--model: "},
      {{"--role", "viewer"}, "--role: "},
      {{"--reconnect-s", "30"}, "--reconnect-s: "},
      {{"--connect", ""}, "--connect: found nothing, expected"}};
  for (const auto& [options, complaint] : cases) {
    std::vector<std::string> arguments = {"run", script};
    arguments.insert(arguments.end(), options.begin(), options.end());
    const ScriptRun result = run(arguments);
    EXPECT_EQ(result.status, 2) << complaint;
    EXPECT_TRUE(result.answers.empty());
    EXPECT_NE(result.errors.find(complaint), std::string::npos) << result.errors;
  }
}

}  // namespace
}  // namespace handloft::model
