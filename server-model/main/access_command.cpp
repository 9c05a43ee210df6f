#include "server-model/main/access_command.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <chrono>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <iostream>
#include <nlohmann/json.hpp>
#include <utility>

#include "common/base/config.h"
#include "common/net/endpoint.h"
#include "common/net/paired_server.h"
#include "server-model/access/access_file.h"
#include "server-model/access/names.h"
#include "server-model/main/serve_command.h"
#include "server-model/main/standard_output.h"

namespace handloft::model {

namespace v1 = handloft::v1;

namespace {

using access::AccessFile;
using access::Seconds;
using Json = nlohmann::ordered_json;

/// What a command found: words for people and the same as JSON.
struct Findings {
  std::string words;
  Json json = Json::object();
};

Seconds now_s() {
  return std::chrono::duration_cast<std::chrono::seconds>(std::chrono::system_clock::now().time_since_epoch())
      .count();
}

std::string utc(Seconds time_s) {
  const std::time_t seconds = time_s;
  std::tm calendar{};
  gmtime_r(&seconds, &calendar);
  return fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", calendar);
}

/// "90s", "15m", "2h", "1d"; a bare number is seconds.
Result<Seconds> parse_span(const std::string& text) {
  constexpr std::array units{std::pair('s', 1), std::pair('m', 60), std::pair('h', 3600),
                             std::pair('d', 86'400)};
  const auto bad = [&] {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found \"{}\", expected a time such as 90s, 15m, 2h or 1d", text), "valid");
  };
  if (text.empty()) return bad();
  Seconds factor = 1;
  std::string_view digits = text;
  const auto* unit =
      std::find_if(units.begin(), units.end(), [&](const auto& each) { return each.first == text.back(); });
  if (unit != units.end()) {
    factor = unit->second;
    digits.remove_suffix(1);
  }
  int count = 0;
  const auto [end, failed] = std::from_chars(digits.data(), digits.data() + digits.size(), count);
  if (failed != std::errc() || end != digits.data() + digits.size() || count < 0) return bad();
  return count * factor;
}

std::string on_model(const std::string& model) {
  return model == access::every_model ? "every model" : fmt::format("\"{}\"", model);
}

/// The options that all commands on the file have.
struct FileOptions {
  std::string file;
  bool json = false;
  void add_to(OptionTable& table) {
    table.add("access", file,
              "The server's access file, which --config with the server's configuration says, too; none: "
              "server.sqlite in $XDG_STATE_HOME/handloft",
              TextRule{.choices = {}, .value_name = "FILE"});
    table.add("json", json, "Answer with one line of JSON");
    pass_over_serve_options(table);
  }
  Result<std::filesystem::path> path(AccessFile::Mode mode) const {
    if (!file.empty()) return std::filesystem::path(file);
    return AccessFile::default_path(mode);
  }
  Result<AccessFile> open() const {
    const auto known = path(AccessFile::Mode::existing);
    if (!known) return known.error();
    return AccessFile::open(*known, AccessFile::Mode::existing, now_s());
  }
};

const TextRule role_rule{.choices = {"viewer", "commenter", "editor", "owner"}, .value_name = ""};

// --- invite

struct InviteOptions {
  FileOptions common;
  std::string role = "editor";
  std::string name;
  std::string model{access::every_model};
  std::string valid = "15m";
};

Result<Findings> invite(const InviteOptions& options) {
  const auto role = access::parse_role(options.role);
  if (!role) return role.error();
  const auto valid = parse_span(options.valid);
  if (!valid) return valid.error();
  // Before a file is made.
  if (auto good = access::check_name(options.name, "name"); !good) return good.error();
  if (auto good = access::check_model(options.model); !good) return good.error();
  const Seconds now = now_s();
  const auto path = options.common.path(AccessFile::Mode::create);
  if (!path) return path.error();
  std::error_code failed;
  const bool is_new = !std::filesystem::exists(*path, failed);
  auto file = AccessFile::open(*path, AccessFile::Mode::create, now);
  if (!file) return file.error();
  const auto code = file->invite({options.name, *role, options.model, *valid}, now);
  if (!code) return code.error();
  const std::string until = utc(now + *valid);
  const std::string made =
      is_new ? fmt::format("\"{0}\" is new, for a server that is started with --access {0}\n", path->string())
             : "";
  return Findings{
      made + fmt::format("For {}, {} on {}, once and until {}:\n\n  {}\n\n"
                         "On the device, once: handloft-hmd --pair CODE --model tls:HOST:PORT\n"
                         "without a display:   handloft-modeld pair CODE --connect tls:HOST:PORT\n",
                         options.name, options.role, on_model(options.model), until, *code),
      {{"code", *code},
       {"user", options.name},
       {"role", options.role},
       {"model", options.model},
       {"until", until},
       {"new_file", is_new}}};
}

// --- users

Result<Findings> users(const FileOptions& options) {
  const auto file = options.open();
  if (!file) return file.error();
  const auto all = file->read();
  if (!all) return all.error();
  Findings found;
  found.json["users"] = Json::array();
  for (const access::Person& person : all->people) {
    Json one{{"name", person.name},
             {"revoked", person.revoked_s != 0},
             {"roles", Json::array()},
             {"devices", Json::array()}};
    found.words +=
        fmt::format("{}{}\n", person.name, person.revoked_s != 0 ? "  revoked " + utc(person.revoked_s) : "");
    for (const access::Grant& grant : person.grants) {
      one["roles"].push_back({{"model", grant.model}, {"role", access::role_name(grant.role)}});
      found.words += fmt::format("  {} on {}\n", access::role_name(grant.role), on_model(grant.model));
    }
    for (const access::Device& device : all->devices) {
      if (device.user != person.name) continue;
      one["devices"].push_back({{"fingerprint", device.fingerprint},
                                {"name", device.name},
                                {"paired", utc(device.paired_s)},
                                {"until", utc(device.until_s)},
                                {"revoked", device.revoked_s != 0}});
      found.words += fmt::format(
          "  device {}  {}  paired {}  {}\n", device.fingerprint.substr(0, 16), device.name,
          utc(device.paired_s),
          device.revoked_s != 0 ? "revoked " + utc(device.revoked_s) : "until " + utc(device.until_s));
    }
    found.json["users"].push_back(std::move(one));
  }
  found.json["invitations"] = Json::array();
  for (const access::OpenInvitation& open : all->invitations) {
    if (open.until_s <= now_s()) continue;
    found.json["invitations"].push_back({{"user", open.user},
                                         {"role", access::role_name(open.role)},
                                         {"model", open.model},
                                         {"until", utc(open.until_s)}});
    found.words += fmt::format("invited: {}, {} on {}, until {}\n", open.user, access::role_name(open.role),
                               on_model(open.model), utc(open.until_s));
  }
  if (found.words.empty()) found.words = "nobody but this host's owner\n";
  return found;
}

// --- role

struct RoleOptions {
  FileOptions common;
  std::string name;
  std::string role;
  std::string model{access::every_model};
};

/// Roles add up, so another one may still allow more than the one that was set; and so may an invitation,
/// once it is taken.
void tell_what_remains(const access::Register& all, const RoleOptions& options, v1::Role set,
                       Findings& found) {
  const auto person = std::find_if(all.people.begin(), all.people.end(),
                                   [&](const access::Person& each) { return each.name == options.name; });
  const bool of_all = options.model == access::every_model;
  const auto results_on = [&](const std::string& model) {
    return person == all.people.end() ? v1::ROLE_UNSPECIFIED : access::granted(*person, model);
  };
  found.json["results"] = access::role_name(results_on(options.model));
  found.json["still"] = Json::array();
  if (person != all.people.end()) {
    for (const access::Grant& grant : person->grants) {
      const bool is_about = of_all || grant.model == access::every_model;
      if (!is_about || access::rank(grant.role) <= access::rank(set)) continue;
      const std::string_view name = access::role_name(grant.role);
      found.json["still"].push_back({{"model", grant.model}, {"role", name}});
      found.words += of_all ? fmt::format("  still {} on {}\n", name, on_model(grant.model))
                            : fmt::format("  still {}, by every model\n", name);
    }
  }
  for (const access::OpenInvitation& open : all.invitations) {
    const bool is_about = of_all || open.model == access::every_model || open.model == options.model;
    if (open.user != options.name || open.until_s <= now_s() || !is_about ||
        access::rank(open.role) <= access::rank(results_on(open.model)))
      continue;
    found.words += fmt::format("  invited: {} on {}, until {}\n", access::role_name(open.role),
                               on_model(open.model), utc(open.until_s));
  }
}

Result<Findings> set_role(const RoleOptions& options) {
  v1::Role role = v1::ROLE_UNSPECIFIED;
  if (options.role != "none") {
    const auto parsed = access::parse_role(options.role);
    if (!parsed) return parsed.error();
    role = *parsed;
  }
  auto file = options.common.open();
  if (!file) return file.error();
  const auto taken = file->set_role(options.name, options.model, role, now_s());
  if (!taken) return taken.error();
  const auto all = file->read();
  if (!all) return all.error();
  Findings found{fmt::format("{} is now {} on {}\n", options.name, options.role, on_model(options.model)),
                 {{"user", options.name}, {"role", options.role}, {"model", options.model}}};
  tell_what_remains(*all, options, role, found);
  found.json["invitations_withdrawn"] = taken->invitations;
  if (taken->invitations > 0) found.words += fmt::format("  withdrawn: {}\n", access::in_words(*taken));
  return found;
}

// --- revoke

struct RevokeOptions {
  FileOptions common;
  std::string user;
  std::string device;
};

Result<Findings> revoke(const RevokeOptions& options) {
  if (options.user.empty() == options.device.empty())
    return make_error(ErrorCode::invalid_argument, "expected either a user's name or --device FINGERPRINT",
                      "NAME");
  auto file = options.common.open();
  if (!file) return file.error();
  if (!options.user.empty()) {
    const auto taken = file->revoke_user(options.user, now_s());
    if (!taken) return taken.error();
    const bool only_invited = !taken->user && taken->devices == 0 && taken->invitations > 0;
    const char* what = taken->user ? "is revoked" : only_invited ? "was only invited" : "was revoked before";
    return Findings{fmt::format("{} {}; withdrawn: {}\n", options.user, what, access::in_words(*taken)),
                    {{"user", options.user},
                     {"devices", taken->devices},
                     {"roles", taken->roles},
                     {"invitations", taken->invitations}}};
  }
  const auto device = file->revoke_device(options.device, now_s());
  if (!device) return device.error();
  return Findings{fmt::format("{} of {} is revoked\n", device->name, device->user),
                  {{"user", device->user}, {"device", device->fingerprint}, {"name", device->name}}};
}

// --- audit

struct AuditOptions {
  FileOptions common;
  int count = 50;
};

Result<Findings> audit(const AuditOptions& options) {
  constexpr std::int64_t ns_per_s = 1'000'000'000;
  const auto file = options.common.open();
  if (!file) return file.error();
  const auto entries = file->audit(static_cast<std::uint32_t>(options.count));
  if (!entries) return entries.error();
  Findings found;
  found.json["entries"] = Json::array();
  for (const access::AuditEntry& entry : *entries) {
    const access::AuditEvent& event = entry.event;
    found.json["entries"].push_back({{"number", entry.number},
                                     {"time", utc(entry.time_ns / ns_per_s)},
                                     {"kind", entry.kind},
                                     {"user", event.user},
                                     {"device", event.device},
                                     {"address", event.address},
                                     {"model", event.model},
                                     {"detail", event.detail}});
    found.words += fmt::format(
        "{}  {:<10}  {:<12}  {:<16}  {:<15}  {:<10}  {}\n", utc(entry.time_ns / ns_per_s), entry.kind,
        event.user.empty() ? "-" : event.user, event.device.empty() ? "-" : event.device.substr(0, 16),
        event.address.empty() ? "-" : event.address, event.model.empty() ? "-" : event.model, event.detail);
  }
  return found;
}

// --- pair

struct PairOptions {
  std::string code;
  std::string connect;
  std::string device;
  bool json = false;
};

Result<Findings> pair(const PairOptions& options) {
  std::string code = options.code;
  if (code == "-") std::getline(std::cin, code);
  const auto endpoint = net::parse_endpoint(options.connect);
  if (!endpoint) return endpoint.error();
  const auto folder = net::paired_servers_folder();
  if (!folder) return folder.error();
  net::PairingOptions pairing;
  pairing.device = options.device;
  const auto server = net::pair(*endpoint, code, pairing, *folder);
  if (!server) return server.error();
  return Findings{fmt::format("Paired with {} as {}, {}. From now on --connect {} works.\n", server->endpoint,
                              server->user, server->role, server->endpoint),
                  {{"endpoint", server->endpoint},
                   {"user", server->user},
                   {"role", server->role},
                   {"authority", server->authority_fingerprint}}};
}

// --- all of them

/// Parses, does it and answers.
template <typename Options, typename Work>
ExitStatus run(OptionTable& table, const std::vector<std::string>& arguments, const bool& json,
               const Options& options, const Work& work) {
  const auto complain = [&](const Error& error) {
    std::fprintf(stderr, "%s: %s\n", table.facts().program.c_str(), error.describe().c_str());
  };
  const auto outcome = table.parse(arguments);
  if (!outcome) {
    complain(outcome.error());
    return exit_usage;
  }
  if (outcome->action == ParseOutcome::Action::show_text) {
    std::fputs(outcome->text.c_str(), stdout);
    return exit_ok;
  }
  const Result<Findings> found = work(options);
  if (!found) {
    complain(found.error());
    return found.error().code == ErrorCode::invalid_argument ? exit_usage : exit_failed;
  }
  const std::string text =
      json ? found->json.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n" : found->words;
  if (const Status told = tell(text); !told) {
    complain(told.error());
    return exit_failed;
  }
  return exit_ok;
}

ExitStatus invite_command(const std::vector<std::string>& arguments) {
  InviteOptions options;
  OptionTable table("handloft-modeld invite",
                    "Prints a one-time code by which somebody's device is paired with the server.");
  table.add("name", options.name, "Whom: a new user or one who gets another device",
            TextRule{.choices = {}, .value_name = "NAME"});
  table.add("role", options.role, "What they may do", role_rule);
  table.add("model", options.model, "On which model; *: on every one",
            TextRule{.choices = {}, .value_name = "MODEL"});
  table.add("valid", options.valid, "How long the code is good: 90s, 15m, 2h, 1d",
            TextRule{.choices = {}, .value_name = "TIME"});
  options.common.add_to(table);
  return run(table, arguments, options.common.json, options, invite);
}

ExitStatus users_command(const std::vector<std::string>& arguments) {
  FileOptions options;
  OptionTable table("handloft-modeld users", "Lists users, their roles and devices, and open invitations.");
  options.add_to(table);
  return run(table, arguments, options.json, options, users);
}

ExitStatus role_command(const std::vector<std::string>& arguments) {
  RoleOptions options;
  OptionTable table("handloft-modeld role",
                    "Gives a user another role on a model or on every one, or none, which also withdraws the "
                    "invitations to it. Roles on a model and on every one add up. A running server follows "
                    "within a second.");
  table.add_positional("NAME", options.name, "The user: of a paired device, or a login name of this host",
                       OptionTable::Presence::required);
  table.add_positional(
      "ROLE", options.role, "viewer, commenter, editor, owner or none", OptionTable::Presence::required,
      TextRule{.choices = {"viewer", "commenter", "editor", "owner", "none"}, .value_name = ""});
  table.add("model", options.model, "On which model; *: on every one",
            TextRule{.choices = {}, .value_name = "MODEL"});
  options.common.add_to(table);
  return run(table, arguments, options.common.json, options, set_role);
}

ExitStatus revoke_command(const std::vector<std::string>& arguments) {
  RevokeOptions options;
  OptionTable table(
      "handloft-modeld revoke",
      "Shuts a user or one device out. A running server closes its connections within a second.");
  table.add_positional("NAME", options.user,
                       "The user or who is invited, with all devices, roles and invitations",
                       OptionTable::Presence::optional);
  table.add("device", options.device, "Only the device whose fingerprint begins so, 8 digits or more",
            TextRule{.choices = {}, .value_name = "FINGERPRINT"});
  options.common.add_to(table);
  return run(table, arguments, options.common.json, options, revoke);
}

ExitStatus audit_command(const std::vector<std::string>& arguments) {
  AuditOptions options;
  OptionTable table("handloft-modeld audit",
                    "Tells who came, left, was refused, invited, paired or revoked, and whose role changed.");
  table.add("count", options.count, "How many of the newest entries",
            NumberRange{.min = 1, .max = 1'000'000, .value_name = "N"});
  options.common.add_to(table);
  return run(table, arguments, options.common.json, options, audit);
}

ExitStatus pair_command(const std::vector<std::string>& arguments) {
  PairOptions options;
  OptionTable table(
      "handloft-modeld pair",
      "Pairs this device with a server by a code of its `handloft-modeld invite`. What it keeps lies in "
      "$XDG_CONFIG_HOME/handloft/servers.");
  table.add_positional("CODE", options.code, "The code, or - for a line of standard input",
                       OptionTable::Presence::required);
  table.add("connect", options.connect, "The server: tls:HOST:PORT",
            TextRule{.choices = {}, .value_name = "ENDPOINT"});
  table.add("device", options.device, "What to call this device; none: the host's name",
            TextRule{.choices = {}, .value_name = "NAME"});
  table.add("json", options.json, "Answer with one line of JSON");
  return run(table, arguments, options.json, options, pair);
}

using Command = ExitStatus (*)(const std::vector<std::string>&);
constexpr std::array commands{std::pair<std::string_view, Command>("invite", invite_command),
                              std::pair<std::string_view, Command>("users", users_command),
                              std::pair<std::string_view, Command>("role", role_command),
                              std::pair<std::string_view, Command>("revoke", revoke_command),
                              std::pair<std::string_view, Command>("audit", audit_command),
                              std::pair<std::string_view, Command>("pair", pair_command)};

}  // namespace

bool is_access_command(const std::string& command) {
  return std::any_of(commands.begin(), commands.end(),
                     [&](const auto& each) { return each.first == command; });
}

ExitStatus access_command(const std::string& command, const std::vector<std::string>& arguments) {
  const auto* found =
      std::find_if(commands.begin(), commands.end(), [&](const auto& each) { return each.first == command; });
  return found == commands.end() ? exit_usage : found->second(arguments);
}

}  // namespace handloft::model
