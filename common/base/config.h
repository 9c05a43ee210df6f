#pragma once
// Options of a program, each defined once: the same table gives the keys of the TOML file, the command line
// flags and the text of --help. A flag beats the file, the file beats the default. An unknown key, a wrong
// type or a value out of range is an error that names file, line and key; nothing is ignored.
//
//   struct Options { std::string listen = "unix:"; double rate_hz = 60; bool loud = false; };
//   Options options;
//   OptionTable table("handloft-x", "Does x.");
//   table.add("listen", options.listen, "Where to listen", {.value_name = "ENDPOINT"});
//   table.add("video.rate_hz", options.rate_hz, "Frames per second", {.min = 1, .max = 240});
//   Result<ParseOutcome> outcome = table.parse(argc, argv);   // --listen X, --video-rate-hz 30, --config
//   FILE
//
// Key "video.rate_hz" is `rate_hz` in the table `[video]` of the file and the flag `--video-rate-hz`.

#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/result.h"

namespace handloft {

/// What values a number may have; both ends are allowed. NaN and infinity never are.
struct NumberRange {
  double min = -std::numeric_limits<double>::max();
  double max = std::numeric_limits<double>::max();
  std::string value_name = {};  ///< How --help calls the value; empty: by its type.
};

struct TextRule {
  std::vector<std::string> choices = {};  ///< Empty: any text.
  std::string value_name = {};            ///< How --help calls the value; empty: TEXT.
};

/// What the command line asked for.
struct ParseOutcome {
  enum class Action {
    run,        ///< Go on.
    show_text,  ///< --help, --version, --man, --completion: print `text` on standard output, end with status
                ///< 0.
  };
  Action action = Action::run;
  std::string text;
  std::string config_file;  ///< The file that was read; empty: none.
};

/// One option as people read of it: for manual pages and completion (manual.h, completion.h).
struct OptionFacts {
  std::string flag;                  ///< "--listen"; of a word without a dash its name, "SCRIPT".
  std::string negation;              ///< "--no-listen" of a boolean; else empty.
  std::string value;                 ///< "ENDPOINT"; empty: takes none.
  std::vector<std::string> choices;  ///< Empty: any.
  std::string help;
  std::string preset;     ///< The default; may be empty.
  bool required = false;  ///< Of a word: the program asks for it.
};

struct ProgramFacts {
  std::string program;  ///< "handloft-modeld serve"
  std::string description;
  std::vector<OptionFacts> words;  ///< Without a dash, in their order.
  std::vector<OptionFacts> options;
};

class OptionTable {
 public:
  OptionTable(std::string program, std::string description);
  ~OptionTable();
  OptionTable(OptionTable&&) noexcept;
  OptionTable& operator=(OptionTable&&) noexcept;

  // Targets hold the defaults and must outlive the table. Keys are snake_case, "room.key" at most two deep,
  // unique. Booleans are the flags --key and --no-key. A vector's flag may be given several times.
  void add(std::string key, bool& target, std::string help);
  void add(std::string key, int& target, std::string help, NumberRange range = {});
  void add(std::string key, std::int64_t& target, std::string help, NumberRange range = {});
  void add(std::string key, std::uint64_t& target, std::string help, NumberRange range = {});
  void add(std::string key, double& target, std::string help, NumberRange range = {});
  void add(std::string key, std::string& target, std::string help, TextRule rule = {});
  void add(std::string key, std::optional<std::string>& target, std::string help, TextRule rule = {});
  void add(std::string key, std::vector<std::string>& target, std::string help, TextRule rule = {});

  /// Words without a dash, in this order ("serve", "SCRIPT.jsonl"): never in the file.
  enum class Presence { required, optional };
  void add_positional(std::string name, std::string& target, std::string help, Presence presence,
                      TextRule rule = {});

  /// For a file that two commands read: keys that only `other` has are no mistake there, and are passed over.
  void pass_over(const OptionTable& other);

  /// Reads the command line and the file that its --config names. On an error some targets may have been set.
  Result<ParseOutcome> parse(int argc, const char* const* argv);
  /// The same with words as a list, without the program's name.
  Result<ParseOutcome> parse(const std::vector<std::string>& arguments);
  /// Only a file's text; `file_name` is for the messages.
  Status parse_toml(std::string_view text, const std::string& file_name);

  /// Whether the last parse() found this key, on the command line or in the file: for an option that means
  /// nothing without another. Precondition: it was added.
  bool given(std::string_view key) const;

  std::string help() const;
  ProgramFacts facts() const;

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace handloft
