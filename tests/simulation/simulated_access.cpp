#include "tests/simulation/simulated_access.h"

#include <algorithm>
#include <cstdlib>
#include <iterator>
#include <limits>
#include <system_error>

namespace handloft::simulation {
namespace {

constexpr std::uint32_t first_uid = 20'000;
constexpr std::uint32_t uid_of_the_server = 19'999;
constexpr std::int64_t for_ever = std::numeric_limits<std::int64_t>::max();

std::string name_of(std::size_t person) {
  return "person" + std::to_string(person);
}

}  // namespace

SimulatedAccess::Folder::Folder() {
  for (const std::filesystem::path& place :
       {std::filesystem::path("/dev/shm"), std::filesystem::temp_directory_path()}) {
    std::string name = (place / "handloft-access-XXXXXX").string();
    if (::mkdtemp(name.data()) == nullptr) continue;
    path = name;
    return;
  }
}

SimulatedAccess::Folder::~Folder() {
  std::error_code ignored;
  if (!path.empty()) std::filesystem::remove_all(path, ignored);
}

std::uint32_t SimulatedAccess::uid_of(std::size_t person) {
  return first_uid + static_cast<std::uint32_t>(person);
}

SimulatedAccess::SimulatedAccess(Timeline& timeline, std::size_t people, Change change, Judge& judge)
    : timeline_(timeline), change_(change), judge_(judge) {
  const auto path = folder_.path / "access";
  const auto now_s = static_cast<access::Seconds>(to_ns(timeline.now()) / 1'000'000'000);
  auto file = access::AccessFile::open(path, access::AccessFile::Mode::create, now_s);
  if (!file) {
    judge_.complain("no access file: " + file.error().describe());
    return;
  }
  file_ = std::make_unique<access::AccessFile>(*std::move(file));
  for (std::size_t person = 0; person < people; ++person) grant(person, v1::ROLE_OWNER);
  access::GateOptions options;
  options.now_ns = [&timeline] { return to_ns(timeline.now()); };
  options.login_of = [](std::uint32_t uid) { return name_of(uid - first_uid); };
  options.own_uid = uid_of_the_server;
  auto gate = access::Gate::open(path, std::move(options), Logger("access", LogLevel::off));
  if (gate) {
    gate_ = *std::move(gate);
  } else {
    judge_.complain("no gate: " + gate.error().describe());
  }
}

void SimulatedAccess::grant(std::size_t person, v1::Role role) {
  if (!file_) return;
  const std::int64_t now_ns = to_ns(timeline_.now());
  const bool may_edit = role == v1::ROLE_EDITOR || role == v1::ROLE_OWNER;
  allow(person);
  if (!may_edit) forbid(person, role);
  ++changes_;
  if (change_ == Change::forgotten && !may_edit) return;
  const auto done = file_->set_role(name_of(person), std::string(access::every_model), role,
                                    static_cast<access::Seconds>(now_ns / 1'000'000'000));
  const bool had_none = !done && access::rank(role) == 0 && done.error().code == ErrorCode::not_found;
  if (!done && !had_none) judge_.complain("a role cannot be changed: " + done.error().describe());
}

void SimulatedAccess::allow(std::size_t person) {
  auto& times = forbidden_[person];
  if (!times.empty() && times.back().until_ns == for_ever) times.back().until_ns = to_ns(timeline_.now());
}

void SimulatedAccess::forbid(std::size_t person, v1::Role role) {
  const std::int64_t from_ns = to_ns(timeline_.now() + from_seconds(seen_within_s));
  forbidden_[person].push_back({from_ns, for_ever, role});
}

void SimulatedAccess::pair(std::size_t person) {
  if (!file_ || (certificates_.contains(person) && without_device_.erase(person) == 0)) return;
  const auto now_s = static_cast<access::Seconds>(to_ns(timeline_.now()) / 1'000'000'000);
  access::AccessFile::Request request;
  access::Invite invite;
  invite.user = name_of(person);
  invite.role = v1::ROLE_OWNER;
  const auto code = file_->invite(invite, now_s);
  const auto key = net::make_key();
  const auto asked = key ? net::make_certificate_request(*key, invite.user) : key;
  if (code && asked) {
    request.code = *code;
    request.certificate_request = *asked;
    request.device = "device of " + invite.user;
    if (const auto paired = file_->pair(request, now_s)) {
      allow(person);
      certificates_[person].name = invite.user;
      certificates_[person].fingerprint = paired->device.fingerprint;
      ++changes_;
      return;
    }
  }
  judge_.complain("a device cannot be paired");
}

void SimulatedAccess::revoke_device(std::size_t person) {
  if (!file_ || !certificates_.contains(person) || !without_device_.insert(person).second) return;
  allow(person);
  forbid(person, v1::ROLE_UNSPECIFIED);
  revoked_.insert(person);
  ++changes_;
  if (change_ == Change::forgotten) return;
  const auto next = std::next(certificates_.find(person));
  const auto& taken = change_ != Change::another    ? certificates_.at(person)
                      : next == certificates_.end() ? certificates_.begin()->second
                                                    : next->second;
  const auto now_s = static_cast<access::Seconds>(to_ns(timeline_.now()) / 1'000'000'000);
  if (const auto done = file_->revoke_device(taken.fingerprint, now_s); !done)
    judge_.complain("a device cannot be revoked: " + done.error().describe());
}

std::optional<net::CertificateFacts> SimulatedAccess::certificate_of(std::size_t person) const {
  const auto found = certificates_.find(person);
  return found == certificates_.end() ? std::nullopt : std::optional(found->second);
}

bool SimulatedAccess::was_forbidden(std::size_t person, const v1::Operation& operation,
                                    std::int64_t at_ns) const {
  const auto found = forbidden_.find(person);
  if (found == forbidden_.end()) return false;
  const bool comments =
      operation.has_add_comment() || operation.has_change_comment() || operation.has_delete_comment();
  return std::any_of(found->second.begin(), found->second.end(), [&](const Time& time) {
    return at_ns >= time.from_ns && at_ns < time.until_ns && !(comments && time.role == v1::ROLE_COMMENTER);
  });
}

}  // namespace handloft::simulation
