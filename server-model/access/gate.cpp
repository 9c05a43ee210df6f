#include "server-model/access/gate.h"

#include <fmt/format.h>
#include <pwd.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <map>
#include <mutex>
#include <utility>

#include "common/base/wall_clock.h"
#include "server-model/access/access_file.h"
#include "server-model/access/names.h"
#include "server-model/access/writer.h"

namespace handloft::access {

namespace {

constexpr std::int64_t ns_per_s = 1'000'000'000;
constexpr Seconds day_s = Seconds{24} * 60 * 60;
/// The server's own certificate is made anew at every start.
constexpr Seconds server_certificate_s = Seconds{2} * 365 * day_s;
constexpr std::uint32_t root = 0;

std::string login_name(std::uint32_t uid) {
  std::array<char, 4096> buffer{};
  passwd entry{};
  passwd* found = nullptr;
  if (getpwuid_r(uid, &entry, buffer.data(), buffer.size(), &found) != 0 || found == nullptr)
    return fmt::format("uid-{}", uid);
  return plain(found->pw_name, 64);
}

/// The register as it is asked: by name and by fingerprint.
struct Known {
  std::uint64_t generation = 0;
  std::map<std::string, Person, std::less<>> people;
  std::map<std::string, Device, std::less<>> devices;
};

std::shared_ptr<const Known> known_of(Register all) {
  auto known = std::make_shared<Known>();
  known->generation = all.generation;
  for (Person& person : all.people) {
    std::string name = person.name;
    known->people.emplace(std::move(name), std::move(person));
  }
  for (Device& device : all.devices) {
    std::string fingerprint = device.fingerprint;
    known->devices.emplace(std::move(fingerprint), std::move(device));
  }
  return known;
}

v1::Role granted(const Known& known, const std::string& user, std::string_view model) {
  const auto person = known.people.find(user);
  return person == known.people.end() ? v1::ROLE_UNSPECIFIED : granted(person->second, model);
}

bool has_any_role(const Known& known, const std::string& user) {
  const auto person = known.people.find(user);
  return person != known.people.end() && person->second.revoked_s == 0 && !person->second.grants.empty();
}

WriterOptions writer_options(const GateOptions& options) {
  WriterOptions own;
  own.audit = options.audit;
  own.certificate_days = options.certificate_days;
  own.wrong_codes_per_minute = options.wrong_codes_per_minute;
  own.wrong_codes_per_minute_in_all = options.wrong_codes_per_minute_in_all;
  return own;
}

Error refused(std::string message, std::string field = "user") {
  return make_error(ErrorCode::permission_denied, std::move(message), std::move(field));
}

}  // namespace

struct Gate::Implementation {
  GateOptions options;
  Logger log;
  std::uint32_t own_uid = 0;
  std::atomic<v1::Role> tcp_role;
  std::atomic<bool> tcp_role_changed = false;

  mutable std::mutex mutex;  ///< Guards `known` and `throttle`.
  std::shared_ptr<const Known> known = std::make_shared<Known>();
  AuditThrottle throttle;

  std::mutex watch_mutex;  ///< Guards `watched`.
  std::optional<AccessFile> watched;
  std::unique_ptr<Writer> writer;  ///< Null: without a file.

  Implementation(GateOptions its_options, Logger its_log)
      : options(std::move(its_options)),
        log(std::move(its_log)),
        tcp_role(options.tcp_role),
        throttle(options.audit) {
    if (!options.now_ns) options.now_ns = wall_clock_ns;
    if (!options.login_of) options.login_of = login_name;
    own_uid = options.own_uid ? *options.own_uid : ::geteuid();
  }

  std::shared_ptr<const Known> people() const {
    const std::lock_guard lock(mutex);
    return known;
  }
  bool owns_server(const User& user) const {
    return user.proof == Proof::local_user && (!writer || user.uid == own_uid || user.uid == root);
  }
  Seconds now_s() const { return options.now_ns() / ns_per_s; }

  void write(AuditEvent event, const std::string& key, AuditThrottle::Who who) {
    if (!writer) return;
    std::uint64_t left_out = 0;
    {
      const std::lock_guard lock(mutex);
      if (!throttle.admits(key, who, now_s())) return;
      left_out = throttle.take_left_out();
    }
    const std::int64_t now = options.now_ns();
    if (left_out > 0) {
      AuditEvent told{AuditKind::suppressed};
      told.detail = fmt::format("{} events were left out: too many in a minute", left_out);
      writer->audit(std::move(told), now);
    }
    writer->audit(std::move(event), now);
  }
  void write(AuditEvent event, const User& user) {
    event.user = user.name;
    event.device = user.device;
    event.address = user.address;
    write(std::move(event), user.name, AuditThrottle::Who::user);
  }
  /// Of somebody whose name nobody has proved.
  Error refuse(const net::PeerInfo& peer, const std::string& reason) {
    AuditEvent event{AuditKind::refusal};
    if (peer.certificate) event.device = peer.certificate->fingerprint;
    event.address = peer.address;
    event.detail = reason;
    const std::string key = peer.uid ? fmt::format("uid {}", *peer.uid) : peer.address;
    write(std::move(event), "stranger " + key, AuditThrottle::Who::stranger);
    return refused(reason);
  }
  Status refuse(const User& user, std::string_view model, const Error& error) {
    AuditEvent event{AuditKind::refusal};
    event.model = model;
    event.detail = error.message;
    write(std::move(event), user);
    return error;
  }

  Result<User> local_user(const net::PeerInfo& peer) {
    if (!writer)
      return User{options.login_of(peer.uid.value_or(own_uid)), Proof::local_user, {}, {}, peer.uid};
    if (!peer.uid) return refuse(peer, "the system does not say who the other end of the socket is");
    User user{options.login_of(*peer.uid), Proof::local_user, {}, {}, peer.uid};
    if (!owns_server(user) && !has_any_role(*people(), user.name))
      return refuse(peer, fmt::format("\"{}\" has no role on this server", user.name));
    return user;
  }
  Result<User> device_user(const net::PeerInfo& peer) {
    if (!writer || !peer.certificate) return refuse(peer, "this device is not paired with this server");
    const auto all = people();
    const auto device = all->devices.find(peer.certificate->fingerprint);
    if (device == all->devices.end())
      return refuse(peer, "this server does not know this device: pair it again");
    if (device->second.revoked_s != 0) return refuse(peer, "this device was revoked");
    if (device->second.until_s <= now_s())
      return refuse(peer, "this device's certificate has ended: pair it again");
    if (!has_any_role(*all, device->second.user))
      return refuse(peer, "this device's user has no role any more");
    return User{device->second.user, Proof::certificate, device->first, peer.address, {}};
  }

  /// After changes of the file. False: nothing that matters has changed.
  bool read_again() {
    const std::lock_guard watching(watch_mutex);
    if (!watched) return false;
    const auto touched = watched->touched();
    if (touched && !*touched) return false;
    const auto generation = touched ? watched->generation() : Result<std::uint64_t>(touched.error());
    if (generation && *generation == people()->generation) return false;
    auto all = generation ? watched->read() : Result<Register>(generation.error());
    if (!all) {
      log.error("the users cannot be read, those that were known stay: {}", all.error().describe());
      return false;
    }
    auto now_known = known_of(*std::move(all));
    const std::lock_guard lock(mutex);
    known = std::move(now_known);
    return true;
  }
};

Gate::Gate(std::unique_ptr<Implementation> implementation) : implementation_(std::move(implementation)) {}

Gate::~Gate() = default;

std::shared_ptr<Gate> Gate::without_file(GateOptions options) {
  return std::shared_ptr<Gate>(
      new Gate(std::make_unique<Implementation>(std::move(options), Logger("access", LogLevel::off))));
}

Result<std::shared_ptr<Gate>> Gate::open(const std::filesystem::path& file, GateOptions options, Logger log) {
  auto made = std::make_unique<Implementation>(std::move(options), std::move(log));
  auto watched = AccessFile::open(file, AccessFile::Mode::create, made->now_s());
  if (!watched) return watched.error();
  auto written = AccessFile::open(file, AccessFile::Mode::existing, made->now_s());
  if (!written) return written.error();
  made->watched = *std::move(watched);
  made->writer = std::make_unique<Writer>(*std::move(written), writer_options(made->options), made->log);
  made->read_again();
  return std::shared_ptr<Gate>(new Gate(std::move(made)));
}

bool Gate::has_users() const {
  return implementation_->writer != nullptr;
}

Result<User> Gate::authenticate(const net::PeerInfo& peer, net::Endpoint::Kind kind) {
  switch (kind) {
    case net::Endpoint::Kind::unix_socket:
      return implementation_->local_user(peer);
    case net::Endpoint::Kind::tls:
      return implementation_->device_user(peer);
    case net::Endpoint::Kind::tcp:
      break;
  }
  if (rank(implementation_->tcp_role) == 0)
    return implementation_->refuse(peer, "nobody may come in by plain TCP");
  return User{"tcp", Proof::unauthenticated, {}, peer.address, {}};
}

v1::Role Gate::role_of(const User& user, std::string_view model) const {
  if (user.proof == Proof::unauthenticated) return implementation_->tcp_role;
  if (implementation_->owns_server(user)) return v1::ROLE_OWNER;
  return granted(*implementation_->people(), user.name, model);
}

bool Gate::owns_host(const User& user) const {
  return implementation_->owns_server(user);
}

Result<v1::Role> Gate::enter(const User& user, std::string_view model, v1::Role asked) {
  if (rank(asked) == 0)
    return make_error(ErrorCode::invalid_argument, "expected viewer, commenter, editor or owner",
                      "hello.role");
  const v1::Role role = role_of(user, model);
  if (at_least(role, asked)) return asked;
  const Error error =
      rank(role) == 0
          ? refused(fmt::format("\"{}\" has no role on \"{}\"", user.name, plain(model)), "join.model")
          : refused(fmt::format("\"{}\" is {} of \"{}\" and cannot come as {}", user.name, role_name(role),
                                plain(model), role_name(asked)),
                    "hello.role");
  return implementation_->refuse(user, model, error).error();
}

bool Gate::still_welcome(const User& user) const {
  if (user.proof == Proof::unauthenticated) return rank(implementation_->tcp_role) > 0;
  if (implementation_->owns_server(user)) return true;
  const auto all = implementation_->people();
  if (!has_any_role(*all, user.name)) return false;
  if (user.proof == Proof::local_user) return true;
  const auto device = all->devices.find(user.device);
  return device != all->devices.end() && device->second.revoked_s == 0 &&
         device->second.until_s > implementation_->now_s();
}

Status Gate::check(const User& user, std::string_view model, v1::Role role, const v1::Operation& operation,
                   Ownership whose) {
  const Status status = access::check(role, operation, whose);
  return status ? status : implementation_->refuse(user, model, status.error());
}

Status Gate::check(const User& user, std::string_view model, v1::Role role, const v1::Query& query) {
  const Status status = access::check(role, query);
  return status ? status : implementation_->refuse(user, model, status.error());
}

Status Gate::check(const User& user, std::string_view model, v1::Role role, v1::Envelope::BodyCase message) {
  const Status status = access::check(role, message);
  return status ? status : implementation_->refuse(user, model, status.error());
}

void Gate::audit(const AuditEvent& event) {
  const bool known = !event.user.empty();
  implementation_->write(event, known ? event.user : "stranger " + event.address,
                         known ? AuditThrottle::Who::user : AuditThrottle::Who::stranger);
}

void Gate::joined(const User& user, std::string_view model, v1::Role role, std::string_view program) {
  AuditEvent event{AuditKind::join};
  event.model = model;
  event.detail = fmt::format("{}: {}", role_name(role), plain(program));
  implementation_->write(std::move(event), user);
}

void Gate::left(const User& user, std::string_view model, std::string_view reason) {
  AuditEvent event{AuditKind::leave};
  event.model = model;
  event.detail = reason;
  implementation_->write(std::move(event), user);
}

void Gate::pair(const v1::Pair& request, const std::string& address, PairingDone done) {
  if (!implementation_->writer) {
    done(refused("this server has no users", "pair"));
    return;
  }
  const std::int64_t now = implementation_->options.now_ns();
  implementation_->writer->pair(
      request, address, now, [this, address, done = std::move(done)](Result<v1::Paired> outcome) {
        if (!outcome) {
          AuditEvent event{AuditKind::refusal};
          event.address = address;
          event.detail = "pairing: " + outcome.error().describe();
          implementation_->write(std::move(event), "stranger " + address, AuditThrottle::Who::stranger);
        } else {
          implementation_->read_again();  // The device may come back at once.
        }
        done(std::move(outcome));
      });
}

bool Gate::poll() {
  const bool others = implementation_->read_again();
  return implementation_->tcp_role_changed.exchange(false) || others;
}

void Gate::set_options(const GateOptions& options) {
  if (implementation_->tcp_role.exchange(options.tcp_role) != options.tcp_role)
    implementation_->tcp_role_changed = true;
  {
    const std::lock_guard lock(implementation_->mutex);
    implementation_->throttle.set_limits(options.audit);
  }
  if (implementation_->writer) implementation_->writer->set_options(writer_options(options));
}

Result<std::shared_ptr<const net::TlsContext>> Gate::server_tls() const {
  const std::lock_guard watching(implementation_->watch_mutex);
  if (!implementation_->watched)
    return make_error(ErrorCode::failed_precondition, "a tls: endpoint needs users: --access FILE", "listen");
  const net::CertificateAuthority& authority = implementation_->watched->authority();
  const Seconds now = implementation_->now_s();
  const auto server = authority.issue_server({now - day_s, now + server_certificate_s});
  if (!server) return server.error();
  return net::TlsContext::for_server(*server, authority.identity().certificate_pem,
                                     net::TlsClients::also_unknown);
}

void Gate::flush() {
  if (implementation_->writer) implementation_->writer->flush();
}

}  // namespace handloft::access
