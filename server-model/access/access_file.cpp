#include "server-model/access/access_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <utility>

#include "server-model/access/access_schema.h"
#include "server-model/access/names.h"

namespace handloft::access {

namespace fs = std::filesystem;
using Step = store::Statement::Step;

namespace {

constexpr Seconds day_s = 24 * 60 * 60;
constexpr Seconds authority_days = 30 * 365;
constexpr Seconds clock_slack_s = day_s;  // Of a device whose clock is behind.
constexpr int pages_until_checkpoint = 256;
constexpr std::size_t longest_detail = 300;
constexpr std::int64_t ns_per_s = 1'000'000'000;

/// A new file is private from its first byte; SQLite gives its side files the same mode.
Status prepare_file(const fs::path& path, AccessFile::Mode mode) {
  if (mode == AccessFile::Mode::create) {
    static_cast<void>(::mkdir(path.parent_path().c_str(), 0700));  // If it cannot be, the next line fails.
    const int fd = ::open(path.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
    if (fd >= 0) {
      ::close(fd);
    } else if (errno != EEXIST) {
      return make_error(ErrorCode::io,
                        fmt::format("cannot make \"{}\": {}", path.string(), std::strerror(errno)), "access");
    }
  }
  struct stat facts {};
  if (::stat(path.c_str(), &facts) != 0)
    return make_error(
        ErrorCode::not_found,
        fmt::format("\"{}\": {}; expected the access file of a server", path.string(), std::strerror(errno)),
        "access");
  if ((facts.st_mode & (S_IRWXG | S_IRWXO)) != 0)
    return make_error(ErrorCode::permission_denied,
                      fmt::format("others may read \"{}\", which holds the server's key: expected mode 0600",
                                  path.string()),
                      "access");
  return {};
}

std::string fact(const store::Database& database, std::string_view name) {
  store::Statement statement = database.prepare("SELECT value FROM facts WHERE name = ?1");
  statement.bind(1, name);
  return statement.step() == Step::row ? std::string(statement.bytes(0)) : std::string();
}

Status put_fact(const store::Database& database, std::string_view name, std::string_view value) {
  store::Statement statement = database.prepare("INSERT OR REPLACE INTO facts VALUES (?1, ?2)");
  statement.bind(1, name).bind(2, value);
  if (!statement.run()) return database.error(name);
  return {};
}

Status make_tables(store::Database& database, Seconds now_s) {
  const auto authority = net::CertificateAuthority::create(
      "Handloft model server", {now_s - clock_slack_s, now_s + authority_days * day_s});
  if (!authority) return authority.error();
  if (auto begun = database.begin(); !begun) return begun;
  // Somebody else may have been faster.
  const auto made = database.integer("SELECT COUNT(*) FROM sqlite_schema WHERE name = 'facts'");
  if (!made || *made != 0) {
    database.rollback();
    return made ? Status() : made.error();
  }
  Status status = database.execute(access_tables);
  if (status) status = put_fact(database, "authority", authority->identity().certificate_pem);
  if (status) status = put_fact(database, "authority_key", authority->identity().key_pem);
  if (status) status = put_fact(database, "generation", "1");
  if (status) status = database.execute(fmt::format("PRAGMA application_id={}", access_application));
  if (status) status = database.execute(fmt::format("PRAGMA user_version={}", access_format));
  if (!status) {
    database.rollback();
    return status;
  }
  return database.commit();
}

Status check_format(const store::Database& database, const fs::path& path) {
  const auto application = database.integer("PRAGMA application_id");
  if (!application) return application.error();
  if (*application != access_application)
    return make_error(ErrorCode::data_corrupt, fmt::format("\"{}\" is no access file", path.string()),
                      "access");
  const auto format = database.integer("PRAGMA user_version");
  if (!format) return format.error();
  if (*format != access_format)
    return make_error(
        ErrorCode::unsupported,
        fmt::format("\"{}\": found format {}, this program knows {}", path.string(), *format, access_format),
        "access");
  store::Statement check = database.prepare("PRAGMA quick_check(1)");
  if (check.step() != Step::row || check.bytes(0) != "ok")
    return make_error(ErrorCode::data_corrupt, fmt::format("\"{}\" is damaged", path.string()), "access");
  return {};
}

}  // namespace

v1::Role granted(const Person& person, std::string_view model) {
  v1::Role best = v1::ROLE_UNSPECIFIED;
  if (person.revoked_s != 0) return best;
  for (const Grant& grant : person.grants) {
    if ((grant.model == model || grant.model == every_model) && rank(grant.role) > rank(best))
      best = grant.role;
  }
  return best;
}

std::string in_words(const Withdrawn& taken) {
  const std::pair<int, std::string_view> kinds[] = {
      {taken.devices, "device"}, {taken.roles, "role"}, {taken.invitations, "invitation"}};
  std::string words;
  for (const auto& [count, kind] : kinds) {
    if (count > 0)
      words += fmt::format("{}{} {}{}", words.empty() ? "" : ", ", count, kind, count == 1 ? "" : "s");
  }
  return words.empty() ? "nothing" : words;
}

AccessFile::AccessFile(store::Database database, net::CertificateAuthority authority, std::string fingerprint)
    : database_(std::move(database)),
      authority_(std::move(authority)),
      fingerprint_(std::move(fingerprint)) {}

Result<fs::path> AccessFile::default_path(Mode mode) {
  const char* state = std::getenv("XDG_STATE_HOME");
  const char* home = std::getenv("HOME");
  fs::path folder;
  if (state != nullptr && state[0] == '/') {
    folder = fs::path(state) / "handloft";
  } else if (home != nullptr && home[0] == '/') {
    folder = fs::path(home) / ".local" / "state" / "handloft";
  } else {
    return make_error(ErrorCode::not_found, "neither XDG_STATE_HOME nor HOME is set", "access");
  }
  if (mode == Mode::existing) return folder / "server.sqlite";
  std::error_code failed;
  fs::create_directories(folder.parent_path(), failed);
  if (::mkdir(folder.c_str(), 0700) != 0 && errno != EEXIST)
    return make_error(ErrorCode::io,
                      fmt::format("cannot make \"{}\": {}", folder.string(), std::strerror(errno)), "access");
  return folder / "server.sqlite";
}

Result<AccessFile> AccessFile::open(const fs::path& path, Mode mode, Seconds now_s) {
  if (const Status prepared = prepare_file(path, mode); !prepared) return prepared.error();
  auto database = store::Database::open(path, store::Database::Access::write, "");
  if (!database) return database.error();
  if (auto wal = database->execute("PRAGMA journal_mode=WAL"); !wal) return wal.error();
  database->allow_checkpoints();
  const auto tables = database->integer("SELECT COUNT(*) FROM sqlite_schema");
  if (!tables) return tables.error();
  if (*tables == 0) {
    if (mode == Mode::existing)
      return make_error(ErrorCode::data_corrupt, fmt::format("\"{}\" is empty", path.string()), "access");
    if (const Status made = make_tables(*database, now_s); !made) return made.error();
  }
  if (const Status good = check_format(*database, path); !good) return good.error();
  auto authority =
      net::CertificateAuthority::load({fact(*database, "authority"), fact(*database, "authority_key")});
  if (!authority) return authority.error();
  const auto facts = net::read_certificate(authority->identity().certificate_pem);
  if (!facts) return facts.error();
  return AccessFile(*std::move(database), *std::move(authority), facts->fingerprint);
}

Result<std::uint64_t> AccessFile::generation() const {
  const auto value = database_.integer("SELECT CAST(value AS INTEGER) FROM facts WHERE name = 'generation'");
  if (!value) return value.error();
  return static_cast<std::uint64_t>(*value);
}

Result<bool> AccessFile::touched() {
  const auto version = database_.integer("PRAGMA data_version");
  if (!version) return version.error();
  return std::exchange(data_version_, *version) != *version;
}

Result<Register> AccessFile::read() const {
  Register all;
  const auto number = generation();
  if (!number) return number.error();
  all.generation = *number;
  store::Statement users = database_.prepare("SELECT name, made_s, revoked_s FROM users ORDER BY name");
  Step step = Step::done;
  while ((step = users.step()) == Step::row)
    all.people.push_back({std::string(users.bytes(0)), users.integer(1), users.integer(2), {}});
  if (step == Step::failed) return database_.error("users");
  store::Statement roles = database_.prepare("SELECT user, model, role FROM roles ORDER BY user, model");
  while ((step = roles.step()) == Step::row) {
    const std::string_view user = roles.bytes(0);
    const auto person = std::find_if(all.people.begin(), all.people.end(),
                                     [&](const Person& each) { return each.name == user; });
    const auto role = static_cast<v1::Role>(roles.integer(2));
    if (person != all.people.end() && rank(role) > 0)
      person->grants.push_back({std::string(roles.bytes(1)), role});
  }
  if (step == Step::failed) return database_.error("roles");
  store::Statement devices = database_.prepare(
      "SELECT fingerprint, user, name, paired_s, until_s, revoked_s FROM devices ORDER BY number");
  while ((step = devices.step()) == Step::row)
    all.devices.push_back({std::string(devices.bytes(0)), std::string(devices.bytes(1)),
                           std::string(devices.bytes(2)), devices.integer(3), devices.integer(4),
                           devices.integer(5)});
  if (step == Step::failed) return database_.error("devices");
  store::Statement open = database_.prepare(
      "SELECT user, model, role, until_s, attempts_left FROM invitations WHERE attempts_left > 0 ORDER BY "
      "until_s");
  while ((step = open.step()) == Step::row)
    all.invitations.push_back({std::string(open.bytes(0)), std::string(open.bytes(1)),
                               static_cast<v1::Role>(open.integer(2)), open.integer(3),
                               static_cast<int>(open.integer(4))});
  if (step == Step::failed) return database_.error("invitations");
  return all;
}

Status AccessFile::after_commit() {
  // A reader's moment may keep it from being copied; the next one does it then.
  if (database_.pages_waiting() > pages_until_checkpoint) static_cast<void>(database_.checkpoint());
  return {};
}

Status AccessFile::change(const std::function<Status()>& what, const AuditEvent& event, Seconds now_s) {
  if (auto begun = database_.begin(); !begun) return begun;
  Status status = what();
  if (status)
    status =
        database_.execute("UPDATE facts SET value = CAST(value AS INTEGER) + 1 WHERE name = 'generation'");
  if (status) status = insert_audit(event, now_s * ns_per_s);
  if (!status) {
    database_.rollback();
    return status;
  }
  if (auto committed = database_.commit(); !committed) return committed;
  return after_commit();
}

Status AccessFile::put_user(const std::string& user, Seconds now_s) {
  store::Statement statement = database_.prepare(
      "INSERT INTO users (name, made_s) VALUES (?1, ?2) ON CONFLICT (name) DO UPDATE SET revoked_s = 0");
  statement.bind(1, user).bind(2, now_s);
  if (!statement.run()) return database_.error("users");
  return {};
}

Status AccessFile::put_role(const std::string& user, const std::string& model, v1::Role role) {
  store::Statement statement = database_.prepare("INSERT OR REPLACE INTO roles VALUES (?1, ?2, ?3)");
  if (!statement.bind(1, user).bind(2, model).bind(3, std::int64_t{role}).run())
    return database_.error("roles");
  return {};
}

Result<Withdrawn> AccessFile::take_role(const std::string& user, const std::string& model) {
  const auto roles = change_rows("DELETE FROM roles WHERE user = ?1 AND model = ?2", {user, model});
  if (!roles) return roles.error();
  const auto open = change_rows("DELETE FROM invitations WHERE user = ?1 AND model = ?2", {user, model});
  if (!open) return open.error();
  Withdrawn taken;
  taken.roles = *roles;
  taken.invitations = *open;
  if (*roles + *open == 0) return nothing_to_take(user, model);
  return taken;
}

Error AccessFile::nothing_to_take(const std::string& user, const std::string& model) const {
  if (const Status named = check_model(model); !named) return named.error();
  const auto all = read();
  if (!all) return all.error();
  const auto on = [](const std::string& name) {
    return name == every_model ? "every model" : fmt::format("\"{}\"", plain(name));
  };
  bool is_known = false;
  std::string rest;
  for (const Person& person : all->people) {
    if (person.name != user) continue;
    is_known = true;
    for (const Grant& grant : person.grants)
      rest += fmt::format(", {} on {}", role_name(grant.role), on(grant.model));
  }
  for (const OpenInvitation& open : all->invitations) {
    if (open.user != user) continue;
    is_known = true;
    rest += fmt::format(", invited as {} on {}", role_name(open.role), on(open.model));
  }
  if (!is_known)
    return make_error(ErrorCode::not_found,
                      fmt::format("there is neither a user nor an invitation \"{}\"", plain(user)), "user");
  return make_error(ErrorCode::not_found,
                    fmt::format("found no role of \"{}\" on {}, only: {}", plain(user), on(model),
                                rest.empty() ? "none" : rest.substr(2)),
                    "model");
}

Result<Withdrawn> AccessFile::set_role(const std::string& user, const std::string& model, v1::Role role,
                                       Seconds now_s) {
  if (auto good = check_name(user, "user"); !good) return good.error();
  // Roles from before names of models were checked can be taken away.
  if (auto good = check_model(model); !good && rank(role) > 0) return good.error();
  AuditEvent event{AuditKind::role, user};
  event.model = model;
  event.detail = role_name(role);
  Withdrawn taken;
  const auto set = [&]() -> Status {
    if (rank(role) > 0) {
      const Status put = put_user(user, now_s);
      return put ? put_role(user, model, role) : put;
    }
    auto took = take_role(user, model);
    if (!took) return took.error();
    taken = *took;
    if (taken.invitations > 0) event.detail += "; withdrawn: " + in_words(taken);
    return {};
  };
  if (const Status done = change(set, event, now_s); !done) return done.error();
  return taken;
}

Result<int> AccessFile::change_rows(const std::string& sql, std::initializer_list<std::string_view> texts) {
  store::Statement statement = database_.prepare(sql);
  int place = 0;
  for (const std::string_view text : texts) statement.bind(++place, text);
  if (!statement.run()) return database_.error(sql);
  const auto rows = database_.integer("SELECT changes()");
  if (!rows) return rows.error();
  return static_cast<int>(*rows);
}

Result<Withdrawn> AccessFile::revoke_user(const std::string& user, Seconds now_s) {
  Withdrawn taken;
  AuditEvent event{AuditKind::revocation, user};
  const auto take = [&]() -> Status {
    store::Statement there = database_.prepare("SELECT 1 FROM users WHERE name = ?1");
    const bool is_known = there.bind(1, user).step() == Step::row;
    there.reset();
    int users = 0;
    const std::pair<int*, std::string> steps[] = {
        {&users, fmt::format("UPDATE users SET revoked_s = {} WHERE name = ?1 AND revoked_s = 0", now_s)},
        {&taken.devices,
         fmt::format("UPDATE devices SET revoked_s = {} WHERE user = ?1 AND revoked_s = 0", now_s)},
        {&taken.roles, "DELETE FROM roles WHERE user = ?1"},
        {&taken.invitations, "DELETE FROM invitations WHERE user = ?1"}};
    for (const auto& [count, sql] : steps) {
      const auto rows = change_rows(sql, {user});
      if (!rows) return rows.error();
      *count = *rows;
    }
    taken.user = users > 0;
    if (!is_known && taken.devices + taken.roles + taken.invitations == 0)
      return make_error(ErrorCode::not_found,
                        fmt::format("there is neither a user nor an invitation \"{}\"", plain(user)), "user");
    event.detail = in_words(taken);
    return {};
  };
  if (const Status done = change(take, event, now_s); !done) return done.error();
  return taken;
}

Result<Device> AccessFile::revoke_device(const std::string& fingerprint, Seconds now_s) {
  constexpr std::size_t shortest = 8;
  const auto all = read();
  if (!all) return all.error();
  std::vector<Device> found;
  for (const Device& device : all->devices) {
    if (fingerprint.size() >= shortest && device.fingerprint.starts_with(fingerprint))
      found.push_back(device);
  }
  if (found.empty())
    return make_error(
        ErrorCode::not_found,
        fmt::format("no device's fingerprint begins with \"{}\" (8 digits or more)", plain(fingerprint)),
        "device");
  if (found.size() > 1)
    return make_error(
        ErrorCode::invalid_argument,
        fmt::format("{} devices' fingerprints begin with \"{}\"", found.size(), plain(fingerprint)),
        "device");
  Device& device = found.front();
  AuditEvent event{AuditKind::revocation, device.user, device.fingerprint};
  event.detail = device.name;
  const Status done = change(
      [&]() -> Status {
        store::Statement statement =
            database_.prepare("UPDATE devices SET revoked_s = ?2 WHERE fingerprint = ?1 AND revoked_s = 0");
        if (!statement.bind(1, device.fingerprint).bind(2, now_s).run()) return database_.error("devices");
        return {};
      },
      event, now_s);
  if (!done) return done.error();
  if (device.revoked_s == 0) device.revoked_s = now_s;
  return device;
}

Status AccessFile::insert_audit(const AuditEvent& event, std::int64_t now_ns) {
  store::Statement statement = database_.prepare(
      "INSERT INTO audit (time_ns, kind, user, device, address, model, detail) VALUES (?1, ?2, ?3, ?4, ?5, "
      "?6, ?7)");
  statement.bind(1, now_ns)
      .bind(2, to_string(event.kind))
      .bind(3, plain(event.user))
      .bind(4, plain(event.device))
      .bind(5, plain(event.address))
      .bind(6, plain(event.model))
      .bind(7, plain(event.detail, longest_detail));
  if (!statement.run()) return database_.error("audit");
  return {};
}

Status AccessFile::add_audit(const std::vector<AuditEvent>& events, std::int64_t now_ns, std::uint32_t most) {
  if (events.empty()) return {};
  if (auto begun = database_.begin(); !begun) return begun;
  Status status;
  for (const AuditEvent& event : events) {
    if (status) status = insert_audit(event, now_ns);
  }
  if (status)
    status = database_.execute(
        fmt::format("DELETE FROM audit WHERE number <= (SELECT MAX(number) FROM audit) - {}", most));
  if (!status) {
    database_.rollback();
    return status;
  }
  if (auto committed = database_.commit(); !committed) return committed;
  return after_commit();
}

Result<std::vector<AuditEntry>> AccessFile::audit(std::uint32_t count) const {
  store::Statement statement = database_.prepare(
      "SELECT number, time_ns, kind, user, device, address, model, detail FROM audit ORDER BY number DESC "
      "LIMIT ?1");
  statement.bind(1, std::int64_t{count});
  std::vector<AuditEntry> entries;
  Step step = Step::done;
  while ((step = statement.step()) == Step::row) {
    AuditEntry entry;
    entry.number = statement.integer(0);
    entry.time_ns = statement.integer(1);
    entry.kind = statement.bytes(2);
    entry.event.user = statement.bytes(3);
    entry.event.device = statement.bytes(4);
    entry.event.address = statement.bytes(5);
    entry.event.model = statement.bytes(6);
    entry.event.detail = statement.bytes(7);
    entries.push_back(std::move(entry));
  }
  if (step == Step::failed) return database_.error("audit");
  std::reverse(entries.begin(), entries.end());
  return entries;
}

}  // namespace handloft::access
