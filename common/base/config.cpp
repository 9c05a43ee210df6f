#include "common/base/config.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <toml++/toml.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <functional>
#include <set>
#include <sstream>
#include <variant>

#include "common/base/completion.h"
#include "common/base/manual.h"
#include "common/base/version.h"

namespace handloft {

namespace {

/// A configuration of ours is a page; more is a mistake (or a device file).
constexpr std::size_t max_config_bytes = 1u << 20;

using Target = std::variant<bool*, int*, std::int64_t*, std::uint64_t*, double*, std::string*,
                            std::optional<std::string>*, std::vector<std::string>*>;

struct Option {
  std::string key;  // empty for a positional
  std::string flag;
  std::string help;
  Target target;
  NumberRange range;
  TextRule rule;
  std::vector<std::string> given;  // words of the command line
  std::optional<bool> given_flag;
  bool in_file = false;
};

struct Positional {
  std::string name;
  std::string help;
  std::string* target;
  OptionTable::Presence presence;
  TextRule rule;
  std::string given;
};

std::string flag_of(const std::string& key) {
  std::string flag = "--" + key;
  for (std::size_t i = 2; i < flag.size(); ++i) {
    if (flag[i] == '.' || flag[i] == '_') flag[i] = '-';
  }
  return flag;
}

Error bad_value(const std::string& where, const std::string& found, const std::string& expected) {
  return make_error(ErrorCode::invalid_argument, fmt::format("found {}, expected {}", found, expected),
                    where);
}

std::string expectation(const NumberRange& range, std::string_view kind) {
  const bool low = range.min > -std::numeric_limits<double>::max();
  const bool high = range.max < std::numeric_limits<double>::max();
  if (low && high) return fmt::format("{} from {} to {}", kind, range.min, range.max);
  if (low) return fmt::format("{} of at least {}", kind, range.min);
  if (high) return fmt::format("{} of at most {}", kind, range.max);
  return std::string(kind);
}

template <typename Number>
Status set_number(Number& target, Number value, const NumberRange& range, std::string_view kind,
                  const std::string& where, const std::string& found) {
  const double as_double = static_cast<double>(value);
  if (!std::isfinite(as_double) || as_double < range.min || as_double > range.max) {
    return bad_value(where, found, expectation(range, kind));
  }
  target = value;
  return {};
}

Status set_text(std::string& target, const std::string& value, const TextRule& rule,
                const std::string& where) {
  if (!rule.choices.empty() &&
      std::find(rule.choices.begin(), rule.choices.end(), value) == rule.choices.end()) {
    return bad_value(where, fmt::format("\"{}\"", value), fmt::format("{}", fmt::join(rule.choices, ", ")));
  }
  if (value.find('\0') != std::string::npos) return bad_value(where, "a zero byte", "text");
  target = value;
  return {};
}

template <typename Number>
Status number_from_text(Number& target, const std::string& text, const Option& option,
                        std::string_view kind) {
  Number value{};
  const char* end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, value);
  if (error != std::errc{} || stop != end) {
    return bad_value(option.flag, fmt::format("\"{}\"", text), expectation(option.range, kind));
  }
  return set_number(target, value, option.range, kind, option.flag, text);
}

constexpr std::string_view whole_number = "a whole number";
constexpr std::string_view number = "a number";

// What stands on the command line.
struct FromText {
  const Option& option;

  Status operator()(bool* target) const {
    if (option.given_flag) *target = *option.given_flag;
    return {};
  }
  Status operator()(int* target) const { return number_from_text(*target, last(), option, whole_number); }
  Status operator()(std::int64_t* target) const {
    return number_from_text(*target, last(), option, whole_number);
  }
  Status operator()(std::uint64_t* target) const {
    if (last().starts_with('-')) {
      return bad_value(option.flag, last(), "a whole number of at least 0");
    }
    return number_from_text(*target, last(), option, whole_number);
  }
  Status operator()(double* target) const { return number_from_text(*target, last(), option, number); }
  Status operator()(std::string* target) const { return set_text(*target, last(), option.rule, option.flag); }
  Status operator()(std::optional<std::string>* target) const {
    return set_text(target->emplace(), last(), option.rule, option.flag);
  }
  Status operator()(std::vector<std::string>* target) const {
    target->clear();
    for (const std::string& word : option.given) {
      if (const Status status = set_text(target->emplace_back(), word, option.rule, option.flag); !status) {
        return status;
      }
    }
    return {};
  }
  const std::string& last() const { return option.given.back(); }
};

std::string describe_node(const toml::node& node) {
  std::ostringstream text;
  if (node.is_table()) return "a table";
  if (node.is_array()) return "an array";
  node.visit([&text](const auto& value) { text << value; });
  return text.str();
}

// What stands in the file.
struct FromToml {
  const Option& option;
  const toml::node& node;
  const std::string& where;

  Status operator()(bool* target) const {
    const auto value = node.value_exact<bool>();
    if (!value) return bad_value(where, describe_node(node), "true or false");
    *target = *value;
    return {};
  }
  template <typename Number>
  Status whole(Number* target) const {
    const auto value = node.value_exact<std::int64_t>();
    const bool fits = value && std::in_range<Number>(*value);
    if (!fits) return bad_value(where, describe_node(node), expectation(option.range, whole_number));
    return set_number(*target, static_cast<Number>(*value), option.range, whole_number, where,
                      describe_node(node));
  }
  Status operator()(int* target) const { return whole(target); }
  Status operator()(std::int64_t* target) const { return whole(target); }
  Status operator()(std::uint64_t* target) const { return whole(target); }
  Status operator()(double* target) const {
    const bool is_number = node.is_floating_point() || node.is_integer();
    const auto value = is_number ? node.value<double>() : std::nullopt;
    if (!value) return bad_value(where, describe_node(node), expectation(option.range, number));
    return set_number(*target, *value, option.range, number, where, describe_node(node));
  }
  Status operator()(std::string* target) const {
    const auto value = node.value_exact<std::string>();
    if (!value) return bad_value(where, describe_node(node), "text in quotes");
    return set_text(*target, *value, option.rule, where);
  }
  Status operator()(std::optional<std::string>* target) const { return (*this)(&target->emplace()); }
  Status operator()(std::vector<std::string>* target) const {
    const toml::array* array = node.as_array();
    if (array == nullptr) return bad_value(where, describe_node(node), "a list of texts");
    std::vector<std::string> texts;
    for (const toml::node& element : *array) {
      const auto value = element.value_exact<std::string>();
      if (!value) return bad_value(where, describe_node(element), "text in quotes");
      if (const Status status = set_text(texts.emplace_back(), *value, option.rule, where); !status) {
        return status;
      }
    }
    *target = std::move(texts);
    return {};
  }
};

// For --help.
struct Describe {
  const Option& option;
  std::string named(const std::string& fallback) const {
    const std::string& name =
        option.rule.value_name.empty() ? option.range.value_name : option.rule.value_name;
    if (!name.empty()) return name;
    if (!option.rule.choices.empty()) return fmt::format("{{{}}}", fmt::join(option.rule.choices, ","));
    return fallback;
  }
  std::pair<std::string, std::string> operator()(bool*) const { return {"", ""}; }
  std::pair<std::string, std::string> operator()(double* target) const {
    return {named("NUMBER"), fmt::format("{}", *target)};
  }
  template <typename Whole>
  std::pair<std::string, std::string> operator()(Whole* target) const requires std::is_integral_v<Whole> {
    return {named("N"), fmt::format("{}", *target)};
  }
  std::pair<std::string, std::string> operator()(std::string* target) const {
    return {named("TEXT"), *target};
  }
  std::pair<std::string, std::string> operator()(std::optional<std::string>* target) const {
    return {named("TEXT"), target->value_or("")};
  }
  std::pair<std::string, std::string> operator()(std::vector<std::string>* target) const {
    return {named("TEXT"), fmt::format("{}", fmt::join(*target, ","))};
  }
};

// CLI11 writes a negated flag as "--no-video{false}", which is its own notation.
class HelpFormatter final : public CLI::Formatter {
 public:
  std::string make_option_name(const CLI::Option* option, bool is_positional) const override {
    const std::string name = CLI::Formatter::make_option_name(option, is_positional);
    constexpr std::string_view negated = "{false}";
    if (!name.ends_with(negated)) return name;
    std::string plain;
    for (const char c : name.substr(0, name.size() - negated.size()))
      plain += c == ',' ? ", " : std::string(1, c);
    return plain;
  }
};

}  // namespace

struct OptionTable::Implementation {
  std::string program;
  std::string description;
  // Deques of pointers: CLI11 keeps references to what it fills.
  std::vector<std::unique_ptr<Option>> options;
  std::vector<std::unique_ptr<Positional>> positionals;
  std::set<std::string> passed_over;  // keys of the file
  std::string config_file;
  bool wants_version = false;

  void add(std::string key, Target target, std::string help, NumberRange range, TextRule rule) {
    assert(find(key) == nullptr && "an option is defined once");
    auto option = std::make_unique<Option>();
    option->flag = flag_of(key);
    option->key = std::move(key);
    option->help = std::move(help);
    option->target = target;
    option->range = std::move(range);
    option->rule = std::move(rule);
    options.push_back(std::move(option));
  }

  Option* find(std::string_view key) {
    for (const auto& option : options) {
      if (option->key == key) return option.get();
    }
    return nullptr;
  }

  void declare(CLI::App& app) {
    app.formatter(std::make_shared<HelpFormatter>());
    app.set_help_flag("-h,--help", "Print this help and end");
    app.add_flag("--version", wants_version, "Print the version and end");
    app.add_option("--config", config_file, "Read options from this TOML file; flags win over it")
        ->type_name("FILE");
    for (const auto& positional : positionals) {
      CLI::Option* word = app.add_option(positional->name, positional->given, positional->help);
      word->required(positional->presence == Presence::required);
      word->type_name("");
    }
    for (const auto& owned : options) {
      Option* option = owned.get();
      if (std::holds_alternative<bool*>(option->target)) {
        const std::string preset = *std::get<bool*>(option->target) ? "on" : "off";
        const std::string negation = "--no-" + option->flag.substr(2);
        app.add_flag_function(
            option->flag + ",!" + negation, [option](std::int64_t count) { option->given_flag = count > 0; },
            fmt::format("{} (default: {})", option->help, preset));
        continue;
      }
      const auto [type, preset] = std::visit(Describe{*option}, option->target);
      app.add_option(option->flag, option->given, option->help)
          ->type_name(type)
          ->expected(1)
          ->default_str(preset)
          ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)
          ->allow_extra_args(false);  // or it would swallow the positionals behind it
    }
  }

  Status read_table(const toml::table& table, const std::string& prefix, const std::string& file_name) {
    for (const auto& [name, node] : table) {
      const std::string key = prefix + std::string(name.str());
      const std::string where = fmt::format("{}:{}: {}", file_name, node.source().begin.line, key);
      if (Option* option = find(key)) {
        if (const Status status = std::visit(FromToml{*option, node, where}, option->target); !status) {
          return status;
        }
        option->in_file = true;
        continue;
      }
      if (passed_over.contains(key)) continue;
      if (node.is_table() && prefix.empty()) {
        if (const Status status = read_table(*node.as_table(), key + ".", file_name); !status) return status;
        continue;
      }
      return make_error(ErrorCode::invalid_argument, "there is no such option" + suggestion(key), where);
    }
    return {};
  }

  // The known key that shares the longest beginning: most unknown keys are slips of the finger.
  std::string suggestion(const std::string& key) const {
    std::string best;
    std::size_t longest = 2;
    for (const auto& option : options) {
      const auto differ = std::mismatch(key.begin(), key.end(), option->key.begin(), option->key.end());
      const auto shared = static_cast<std::size_t>(differ.first - key.begin());
      if (shared > longest) {
        longest = shared;
        best = option->key;
      }
    }
    return best.empty() ? std::string() : fmt::format("; did you mean \"{}\"?", best);
  }

  Status apply_words() {
    for (const auto& option : options) {
      if (option->given.empty() && !option->given_flag) continue;
      if (const Status status = std::visit(FromText{*option}, option->target); !status) return status;
    }
    for (const auto& positional : positionals) {
      if (positional->given.empty()) continue;
      const Status status =
          set_text(*positional->target, positional->given, positional->rule, positional->name);
      if (!status) return status;
    }
    return {};
  }
};

OptionTable::OptionTable(std::string program, std::string description)
    : implementation_(std::make_unique<Implementation>()) {
  implementation_->program = std::move(program);
  implementation_->description = std::move(description);
}
OptionTable::~OptionTable() = default;
OptionTable::OptionTable(OptionTable&&) noexcept = default;
OptionTable& OptionTable::operator=(OptionTable&&) noexcept = default;

void OptionTable::add(std::string key, bool& target, std::string help) {
  implementation_->add(std::move(key), &target, std::move(help), {}, {});
}
void OptionTable::add(std::string key, int& target, std::string help, NumberRange range) {
  implementation_->add(std::move(key), &target, std::move(help), std::move(range), {});
}
void OptionTable::add(std::string key, std::int64_t& target, std::string help, NumberRange range) {
  implementation_->add(std::move(key), &target, std::move(help), std::move(range), {});
}
void OptionTable::add(std::string key, std::uint64_t& target, std::string help, NumberRange range) {
  implementation_->add(std::move(key), &target, std::move(help), std::move(range), {});
}
void OptionTable::add(std::string key, double& target, std::string help, NumberRange range) {
  implementation_->add(std::move(key), &target, std::move(help), std::move(range), {});
}
void OptionTable::add(std::string key, std::string& target, std::string help, TextRule rule) {
  implementation_->add(std::move(key), &target, std::move(help), {}, std::move(rule));
}
void OptionTable::add(std::string key, std::optional<std::string>& target, std::string help, TextRule rule) {
  implementation_->add(std::move(key), &target, std::move(help), {}, std::move(rule));
}
void OptionTable::add(std::string key, std::vector<std::string>& target, std::string help, TextRule rule) {
  implementation_->add(std::move(key), &target, std::move(help), {}, std::move(rule));
}

void OptionTable::add_positional(std::string name, std::string& target, std::string help, Presence presence,
                                 TextRule rule) {
  auto positional = std::make_unique<Positional>();
  positional->name = std::move(name);
  positional->help = std::move(help);
  positional->target = &target;
  positional->presence = presence;
  positional->rule = std::move(rule);
  implementation_->positionals.push_back(std::move(positional));
}

void OptionTable::pass_over(const OptionTable& other) {
  for (const auto& option : other.implementation_->options) implementation_->passed_over.insert(option->key);
}

Result<ParseOutcome> OptionTable::parse(int argc, const char* const* argv) {
  std::vector<std::string> arguments;
  for (int i = 1; i < argc; ++i) arguments.emplace_back(argv[i]);
  return parse(arguments);
}

Result<ParseOutcome> OptionTable::parse(const std::vector<std::string>& arguments) {
  Implementation& table = *implementation_;
  table.wants_version = false;
  table.config_file.clear();
  for (const auto& option : table.options) {
    option->given.clear();
    option->given_flag.reset();
    option->in_file = false;
  }
  for (const auto& positional : table.positionals) positional->given.clear();

  ParseOutcome outcome;
  auto asked = completion_asked_for(*this, arguments);
  if (!asked) return asked.error();
  if (!*asked) *asked = manual_asked_for(*this, arguments);
  if (*asked) {
    outcome.action = ParseOutcome::Action::show_text;
    outcome.text = **std::move(asked);
    return outcome;
  }
  CLI::App app(table.description, table.program);
  table.declare(app);
  try {
    std::vector<std::string> reversed(arguments.rbegin(), arguments.rend());  // as CLI11 wants them
    app.parse(reversed);
  } catch (const CLI::CallForHelp&) {
    outcome.action = ParseOutcome::Action::show_text;
    outcome.text = app.help();
    return outcome;
  } catch (const CLI::ParseError& error) {
    if (table.wants_version) {  // before a positional is missed
      outcome.action = ParseOutcome::Action::show_text;
      outcome.text = program_version(table.program) + "\n";
      return outcome;
    }
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("{}; {} --help tells what there is", error.what(), table.program),
                      "command line");
  }
  if (table.wants_version) {
    outcome.action = ParseOutcome::Action::show_text;
    outcome.text = program_version(table.program) + "\n";
    return outcome;
  }
  if (!table.config_file.empty()) {
    std::ifstream file(table.config_file, std::ios::binary);
    if (!file) return make_error(ErrorCode::not_found, "cannot be opened", table.config_file);
    std::string text(max_config_bytes + 1, '\0');
    file.read(text.data(), static_cast<std::streamsize>(text.size()));
    if (file.bad()) return make_error(ErrorCode::io, "cannot be read", table.config_file);
    text.resize(static_cast<std::size_t>(file.gcount()));
    if (const Status status = parse_toml(text, table.config_file); !status) return status.error();
    outcome.config_file = table.config_file;
  }
  if (const Status status = table.apply_words(); !status) return status.error();
  return outcome;
}

Status OptionTable::parse_toml(std::string_view text, const std::string& file_name) {
  if (text.size() > max_config_bytes) {
    return make_error(ErrorCode::resource_exhausted,
                      fmt::format("is larger than {} bytes, which no configuration is", max_config_bytes),
                      file_name);
  }
  try {
    const toml::table table = toml::parse(text, file_name);
    return implementation_->read_table(table, "", file_name);
  } catch (const toml::parse_error& error) {
    return make_error(ErrorCode::invalid_argument, std::string(error.description()),
                      fmt::format("{}:{}", file_name, error.source().begin.line));
  }
}

bool OptionTable::given(std::string_view key) const {
  const Option* option = implementation_->find(key);
  assert(option != nullptr && "it was added");
  return option->in_file || option->given_flag || !option->given.empty();
}

std::string OptionTable::help() const {
  CLI::App app(implementation_->description, implementation_->program);
  implementation_->declare(app);
  return app.help();
}

ProgramFacts OptionTable::facts() const {
  ProgramFacts facts{implementation_->program, implementation_->description, {}, {}};
  for (const auto& word : implementation_->positionals)
    facts.words.push_back(
        {word->name, "", "", word->rule.choices, word->help, "", word->presence == Presence::required});
  for (const auto& option : implementation_->options) {
    const auto [value, preset] = std::visit(Describe{*option}, option->target);
    OptionFacts one{option->flag, "", value, option->rule.choices, option->help, preset};
    if (const auto* flag = std::get_if<bool*>(&option->target)) {
      one.negation = "--no-" + option->flag.substr(2);
      one.preset = **flag ? "on" : "off";
    }
    facts.options.push_back(std::move(one));
  }
  return facts;
}

}  // namespace handloft
