// Any bytes as a script: one line of valid JSON for each, never a crash. Files are out of reach.

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>

#include "server-model/model/model.h"
#include "server-model/session/script_runner.h"

namespace {

/// A model without files.
class Target final : public handloft::model::ScriptTarget {
 public:
  handloft::Result<Outcome> submit(const handloft::v1::Operation& operation) override {
    auto submitted = model_.submit(operation);
    if (!submitted) return submitted.error();
    return Outcome{submitted->sequence, submitted->changes.all(), submitted->notes};
  }
  handloft::Result<handloft::v1::QueryResult> query(const handloft::v1::Query& query) override {
    return model_.query(query);
  }

 private:
  handloft::model::Model model_;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Target target;
  std::istringstream in(std::string(reinterpret_cast<const char*>(data), size));
  std::ostringstream out;
  handloft::model::ScriptOptions options;
  options.on_failure = handloft::model::ScriptOptions::OnFailure::keep_going;
  options.max_line_bytes = 4096;
  const auto summary = handloft::model::run_script(in, out, target, options);
  std::istringstream answers(out.str());
  std::size_t count = 0;
  for (std::string line; std::getline(answers, line); ++count) {
    if (!nlohmann::json::accept(line)) std::abort();
  }
  if (count != summary.lines_run) std::abort();
  return 0;
}
