// Scripts line by line (U7): one answer a line, failures that name the line, expectations.

#include "server-model/session/script_runner.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <sstream>

#include "server-model/session/local_target.h"

namespace handloft::model {
namespace {

using nlohmann::json;

struct ScriptRun {
  ScriptSummary summary;
  std::vector<json> answers;
};

ScriptRun run(const std::string& script, const ScriptOptions& options = {}) {
  LocalTarget target(FileAccess{});
  std::istringstream in(script);
  std::ostringstream out;
  ScriptRun result;
  result.summary = run_script(in, out, target, options);
  std::istringstream lines(out.str());
  for (std::string line; std::getline(lines, line);) result.answers.push_back(json::parse(line));
  return result;
}

const std::string create = R"({"createDualShape": {"id": "top"}})";

// What one more line after `create` answers.
json after_create(const std::string& line) {
  return run(create + "\n" + line).answers.back();
}

void expect_failure(const std::string& line, const std::string& code, const std::string& field) {
  const json answer = after_create(line);
  EXPECT_FALSE(answer["ok"].get<bool>()) << answer;
  EXPECT_EQ(answer["line"], 2);
  EXPECT_EQ(answer["error"]["code"], code) << answer;
  EXPECT_EQ(answer["error"]["field"], field) << answer;
  EXPECT_NE(answer["error"]["message"], "");
}

TEST(Script, AnswersEachLineWithOneLine) {
  const ScriptRun result =
      run("# a comment\n\n" + create + "\r\n  // another\n\t\n" + R"({"query": {"entities": {}}})");
  EXPECT_TRUE(result.summary.ok());
  EXPECT_EQ(result.summary.lines_run, 2U);
  ASSERT_EQ(result.answers.size(), 2U);
  EXPECT_EQ(result.answers[0],
            json::parse(R"({"line":3,"ok":true,"result":{"sequence":1,"entities":["top"]}})"));
  EXPECT_EQ(result.answers[1]["line"], 6);
  EXPECT_EQ(result.answers[1]["result"]["entities"]["entities"][0]["id"], "top");
}

TEST(Script, StopsAtTheFirstFailureUnlessToldOtherwise) {
  const std::string script = create + "\n" + create + "\n{\"undo\":{}}\n{\"undo\":{}}\n";
  const ScriptRun stopped = run(script);
  EXPECT_EQ(stopped.answers.size(), 2U);
  EXPECT_EQ(stopped.summary.first_failed_line, 2U);
  EXPECT_NE(stopped.summary.first_failure.find("already_exists"), std::string::npos);
  ScriptOptions options;
  options.on_failure = ScriptOptions::OnFailure::keep_going;
  const ScriptRun all = run(script, options);
  EXPECT_EQ(all.answers.size(), 4U);
  EXPECT_EQ(all.summary.lines_failed, 2U);
  EXPECT_EQ(all.summary.first_failed_line, 2U);
  EXPECT_TRUE(all.answers[2]["ok"].get<bool>());
}

TEST(Script, SnakeCaseIsAcceptedToo) {
  EXPECT_TRUE(run(R"({"create_dual_shape": {"id": "a"}})").summary.ok());
  EXPECT_TRUE(
      after_create(
          R"({"expect":{"query":{"entities":{}},"path":"entities.entities.0.point_count","at_most":0}})")
          ["ok"]
              .get<bool>());
}

TEST(Script, ExpectationsRememberWhatTheyFound) {
  const std::string remember = R"({"expect":{"query":{"hash":{}},"path":"hash.sha256","remember":"start"}})";
  const std::string same =
      R"({"expect":{"query":{"hash":{}},"path":"hash.sha256","equalsRemembered":"start"}})";
  const std::string second = R"({"createDualShape":{"id":"second"}})";
  const std::string undo = R"({"undo":{}})";
  EXPECT_TRUE(run(remember + "\n" + same).summary.ok());
  ScriptOptions on;
  on.on_failure = ScriptOptions::OnFailure::keep_going;
  const ScriptRun changed =
      run(create + "\n" + remember + "\n" + second + "\n" + same + "\n" + undo + "\n" + same, on);
  EXPECT_EQ(changed.summary.lines_failed, 1U);
  EXPECT_EQ(changed.summary.first_failed_line, 4U) << "before the undo it is another document";
  EXPECT_EQ(changed.answers[3]["error"]["code"], "failed_precondition");
  // What doesn't hold otherwise is not remembered.
  const ScriptRun failed =
      run(R"({"expect":{"query":{"hash":{}},"path":"hash.sha256","equals":"","remember":"start"}})"
          "\n" +
              same,
          on);
  EXPECT_EQ(failed.summary.lines_failed, 2U);
  EXPECT_EQ(failed.answers[1]["error"]["field"], "expect.equalsRemembered");
  EXPECT_EQ(failed.answers[1]["error"]["code"], "invalid_argument");
  expect_failure(R"({"expect":{"query":{"hash":{}},"remember":7}})", "invalid_argument", "expect.remember");
}

TEST(Script, NumbersKeepEveryBit) {
  const ScriptRun result = run(
      create + "\n" +
      R"({"addPoints":{"entity":"top","points":[{"position":{"x":0.1,"y":1e-17,"z":-0.30000000000000004},"pressure":0.9999999999999999,"timeNs":"9007199254740993"}]}})"
      "\n"
      R"({"query":{"points":{"entity":"top"}}})");
  ASSERT_TRUE(result.summary.ok());
  const json& point = result.answers[2]["result"]["points"]["points"][0];
  EXPECT_EQ(point["position"]["x"].get<double>(), 0.1);
  EXPECT_EQ(point["position"]["y"].get<double>(), 1e-17);
  EXPECT_EQ(point["position"]["z"].get<double>(), -0.30000000000000004);
  EXPECT_EQ(point["pressure"].get<double>(), 0.9999999999999999);
}

TEST(Script, U1_EachClientOfAScriptHasItsOwnSteps) {
  const ScriptRun result =
      run(R"({"createDualShape": {"id": "one"}, "clientId": "7", "author": "Ann"})"
          "\n"
          R"({"createDualShape": {"id": "two"}, "clientId": "8", "author": "Bob"})"
          "\n"
          R"({"undo": {}, "clientId": "7"})"
          "\n"
          R"({"expect": {"fails": {"undo": {}}, "code": "failed_precondition"}})"
          "\n"
          R"({"expect": {"query": {"history": {}}, "path": "history.steps.0.author", "equals": "Ann"}})"
          "\n"
          R"({"query": {"entities": {}}})");
  ASSERT_TRUE(result.summary.ok()) << result.summary.first_failure;
  const json& entities = result.answers.back()["result"]["entities"]["entities"];
  ASSERT_EQ(entities.size(), 1U);
  EXPECT_EQ(entities[0]["id"], "two");
}

TEST(Script, UnknownFieldsAreRefusedByName) {
  expect_failure(R"({"createDualShape": {"idd": "x"}})", "invalid_argument", "create_dual_shape.idd");
  expect_failure(R"({"makeShape": {}})", "invalid_argument", "makeShape");
  expect_failure(R"({"query": {"surfaces": {}}})", "invalid_argument", "query.surfaces");
  expect_failure(R"({"query": {"surface": {"name": "top"}}})", "invalid_argument", "query.surface.name");
  expect_failure(R"({"expect": {"query": {"hash": {}}, "equal": 1}})", "invalid_argument", "expect.equal");
  expect_failure(R"({"expect": {"fails": {"undo": {}}, "code": "x", "why": ""}})", "invalid_argument",
                 "expect.why");
}

// Two lines with one number were taken for one operation that is sent again: the second did nothing.
TEST(Script, NumbersForSendingAgainAreRefused) {
  expect_failure(R"({"createDualShape": {"id": "x"}, "clientOpId": "3"})", "invalid_argument", "clientOpId");
  EXPECT_TRUE(after_create(R"({"createDualShape": {"id": "x"}, "clientOpId": "0"})")["ok"].get<bool>());
}

TEST(Script, MalformedLinesFailAndNothingElseHappens) {
  for (const std::string& line :
       {std::string("{"), std::string("nonsense"), std::string("[]"), std::string("3"),
        std::string("\"undo\""), std::string("{\"undo\":{}} {}"), std::string("{\"undo\":{},\"undo\":{}}"),
        std::string("{\"undo\":{},}"), std::string("{\"rename\":{\"entity\":\"top\",\"name\":\"\xff\xfe\"}}"),
        std::string("{\"\0\":1}", 7), std::string(100'000, '['), "{\"a\":" + std::string(100'000, '[')}) {
    expect_failure(line, "invalid_argument", "");
  }
  expect_failure(R"({})", "invalid_argument", "");
  expect_failure(R"({"undo": {}, "query": {"hash": {}}})", "invalid_argument", "query");
  EXPECT_FALSE(after_create(R"({"undo": {}, "redo": {}})")["ok"].get<bool>());
  EXPECT_FALSE(
      after_create(R"({"setSuperellipse": {"entity": "top", "exponent": "NaN"}})")["ok"].get<bool>());
  EXPECT_FALSE(
      after_create(R"({"setSuperellipse": {"entity": "top", "exponent": 1e999}})")["ok"].get<bool>());
}

TEST(Script, RefusalsOfJsonSayInOurWordsWhatWasFoundAndExpected) {
  struct Case {
    std::string line, field, message;
  };
  const std::string up_to_32_bits = ", expected a whole number from 0 to 4294967295";
  for (const Case& it : std::vector<Case>{
           {R"({"fit": {"entity": "top", "degree": -1}})", "fit.degree", "found -1" + up_to_32_bits},
           {R"({"fit": {"entity": "top", "degree": 4294967296}})", "fit.degree",
            "found 4294967296" + up_to_32_bits},
           {R"({"fit": {"entity": "top", "degree": 1.5}})", "fit.degree", "found 1.5" + up_to_32_bits},
           {R"({"fit": {"entity": "top", "degree": "two"}})", "fit.degree", "found \"two\"" + up_to_32_bits},
           {R"({"fit": {"entity": "top", "degree": {}}})", "fit.degree", "found an object" + up_to_32_bits},
           {R"({"setSymmetry": {"entity": "top", "mode": "BOTH"}})", "set_symmetry.mode",
            "found \"BOTH\", expected OFF, SAME_SHAPE, PARTNER"},
           {R"({"setSymmetry": {"entity": "top", "plane": 3}})", "set_symmetry.plane",
            "found 3, expected an object"},
           {R"({"undo": {}, "redo": {}})", "undo", "found \"undo\" beside \"redo\", expected one of them"},
           {R"({"undo": 1})", "undo", "found 1, expected an object"},
           {R"({"addPoints": {"points": [{"position": {"x": 1}}, {"position": {"x": "one"}}]}})",
            "add_points.points[1].position.x", "found \"one\", expected a number"},
           {R"({"addPoints": {"points": [{"timeNs": "9223372036854775808"}]}})",
            "add_points.points[0].time_ns",
            "found \"9223372036854775808\", expected a whole number from -9223372036854775808 to "
            "9223372036854775807"},
           {R"({"export": {"path": "a.obj", "untrimmed": "maybe"}})", "export.untrimmed",
            "found \"maybe\", expected true or false"},
           {R"({"rename": {"entity": ["top"]}})", "rename.entity", "found a list, expected text in quotes"},
           {R"({"query": "hash"})", "query", "found \"hash\", expected an object"},
           {R"({"query": {"evaluate": {"at": [{"x": true}]}}})", "query.evaluate.at[0].x",
            "found true, expected a number"},
       }) {
    const json answer = after_create(it.line);
    EXPECT_EQ(answer["error"]["code"], "invalid_argument") << it.line;
    EXPECT_EQ(answer["error"]["field"], it.field) << it.line;
    EXPECT_EQ(answer["error"]["message"], it.message) << it.line;
  }
}

TEST(Script, AMemberTwiceInOneObjectIsRefusedByName) {
  const auto twice = [](const std::string& line, const std::string& name, const std::string& field) {
    const json answer = after_create(line);
    EXPECT_EQ(answer["error"]["message"], "found \"" + name + "\" twice") << answer;
    EXPECT_EQ(answer["error"]["field"], field);
  };
  twice(R"({"createDualShape": {"id": "a", "id": "b"}})", "id", "create_dual_shape.id");
  twice(R"({"undo": {}, "undo": {}})", "undo", "");
  twice(R"({"addPoints": {"entity": "top", "points": [{}, {"position": {"x": 1, "y": 2, "x": 3}}]}})", "x",
        "add_points.points[1].position.x");
  twice(R"({"addPoints": {"minSpacingM": 1, "min_spacing_m": 2}})", "min_spacing_m",
        "add_points.min_spacing_m");
  // The same name in different objects is fine.
  EXPECT_TRUE(run(R"({"createDualShape": {"id": "a"}})"
                  "\n"
                  R"({"setSymmetry": {"entity": "a", "plane": {"origin": {"x": 0}, "normal": {"x": 1}}}})")
                  .summary.ok());
}

TEST(Script, AByteOrderMarkAtTheBeginningIsSkipped) {
  EXPECT_TRUE(run("\xef\xbb\xbf" + create).summary.ok());
  EXPECT_TRUE(run("\xef\xbb\xbf# made by an editor\n" + create).summary.ok());
  EXPECT_EQ(run("\xef\xbb\xbf").summary.lines_run, 0U);
  EXPECT_FALSE(run(create + "\n\xef\xbb\xbf" + create).summary.ok());  // it begins files, not lines
}

TEST(Script, ALineThatIsTooLongFailsAndTheNextIsRead) {
  ScriptOptions options;
  options.max_line_bytes = 64;
  options.on_failure = ScriptOptions::OnFailure::keep_going;
  const ScriptRun result = run("{\"x\":\"" + std::string(1000, 'x') + "\"}\n" + create, options);
  ASSERT_EQ(result.answers.size(), 2U);
  EXPECT_EQ(result.answers[0]["error"]["code"], "resource_exhausted");
  EXPECT_TRUE(result.answers[1]["ok"].get<bool>());
}

TEST(Script, ARefusalNamesCodeFieldAndReason) {
  expect_failure(R"({"fit": {"entity": "side"}})", "not_found", "fit.entity");
  expect_failure(R"({"fit": {"entity": "top"}})", "rank_deficient", "fit.entity");
  expect_failure(R"({"query": {"surface": {"entity": "top"}}})", "failed_precondition", "surface.entity");
  expect_failure(R"({"export": {"path": "a.step"}})", "failed_precondition", "export.entities");
}

TEST(Script, NotesReachTheAnswer) {
  const ScriptRun result =
      run(create + "\n" +
          R"({"addPoints":{"entity":"top","points":[{"position":{"x":0,"y":0,"z":0},"pressure":1},)"
          R"({"position":{"x":1,"y":0,"z":0},"pressure":1},{"position":{"x":0,"y":1,"z":0},"pressure":1},)"
          R"({"position":{"x":1,"y":2,"z":0},"pressure":1}]}})"
          "\n{\"fit\":{\"entity\":\"top\"}}");
  ASSERT_TRUE(result.summary.ok());
  EXPECT_EQ(result.answers[2]["result"]["notes"].size(), 1U);
}

bool holds(const std::string& expectation) {
  return after_create("{\"expect\":" + expectation + "}")["ok"].get<bool>();
}

std::string on_entity(const std::string& rest) {
  return R"({"query":{"entities":{}},"path":"entities.entities.0)" + rest + "}";
}

TEST(Expectation, ComparesAndCanFail) {
  EXPECT_TRUE(holds(on_entity(R"(.id","equals":"top")")));
  EXPECT_FALSE(holds(on_entity(R"(.id","equals":"side")")));
  EXPECT_TRUE(holds(on_entity(R"(.degree","equals":2)")));
  EXPECT_TRUE(holds(on_entity(R"(.degree","equals":2.0)")));
  EXPECT_FALSE(holds(on_entity(R"(.degree","equals":2.0000001)")));
  EXPECT_TRUE(holds(on_entity(R"(.degree","near":2.1,"tolerance":0.2)")));
  EXPECT_FALSE(holds(on_entity(R"(.degree","near":2.1,"tolerance":0.05)")));
  EXPECT_TRUE(holds(on_entity(R"(.degree","atLeast":2,"atMost":2)")));
  EXPECT_FALSE(holds(on_entity(R"(.degree","atLeast":2.1)")));
  EXPECT_FALSE(holds(on_entity(R"(.degree","atMost":1.9)")));
  EXPECT_FALSE(holds(on_entity(R"(.id","atMost":1.9)")));
  EXPECT_TRUE(holds(on_entity(R"(.revision","equals":1)")));  // A 64-bit integer, written as a string.
  EXPECT_TRUE(holds(on_entity(R"(.fitted","equals":false)")));
  EXPECT_FALSE(holds(on_entity(R"(.fitted","equals":0)")));
  EXPECT_FALSE(holds(on_entity(R"(.nothing","equals":0)")));
  EXPECT_TRUE(holds(R"({"query":{"entities":{}},"path":"/entities/entities/0/name","equals":"top"})"));
  EXPECT_TRUE(holds(R"({"query":{"entities":{}},"path":"entities.entities","count":1})"));
  EXPECT_FALSE(holds(R"({"query":{"entities":{}},"path":"entities.entities","count":2})"));
  EXPECT_FALSE(holds(R"({"query":{"entities":{}},"path":"entities.entities.1","equals":{}})"));
}

TEST(Expectation, RefusalsAreExpectedByCodeAndField) {
  EXPECT_TRUE(holds(R"({"fails":{"fit":{"entity":"x"}}})"));
  EXPECT_TRUE(holds(R"({"fails":{"fit":{"entity":"x"}},"code":"not_found","field":"fit.entity"})"));
  EXPECT_FALSE(holds(R"({"fails":{"fit":{"entity":"x"}},"code":"invalid_argument"})"));
  EXPECT_FALSE(holds(R"({"fails":{"fit":{"entity":"x"}},"field":"entity"})"));
  EXPECT_FALSE(holds(R"({"fails":{"rename":{"entity":"top","name":"Top"}}})"));
  EXPECT_TRUE(holds(R"({"fails":{"query":{"surface":{"entity":"top"}}},"code":"failed_precondition"})"));
  EXPECT_TRUE(holds(R"({"fails":{"bogus":{}},"code":"invalid_argument","field":"bogus"})"));
}

TEST(Expectation, WrongExpectationsFail) {
  for (const char* wrong : {"3", "{}", R"({"query":{"hash":{}}})", R"({"query":{"hash":{}},"path":"hash"})",
                            R"({"query":{"hash":{}},"path":3,"equals":3})",
                            R"({"query":{"entities":{}},"path":"entities","near":3})",
                            R"({"query":{"entities":{}},"tolerance":3,"equals":3})", R"({"fails":3})",
                            R"({"fails":{"undo":{}},"code":3})", R"({"query":3,"equals":3})",
                            R"({"query":{"entities":{}},"atMost":"3"})"}) {
    EXPECT_FALSE(holds(wrong)) << wrong;
  }
}

}  // namespace
}  // namespace handloft::model
