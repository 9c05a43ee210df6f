#include "server-model/access/writer.h"

#include <fmt/format.h>

#include <utility>

#include "common/net/address.h"

namespace handloft::access {

namespace {
constexpr std::int64_t ns_per_s = 1'000'000'000;
constexpr std::int64_t ns_per_minute = 60 * ns_per_s;
}  // namespace

Writer::Writer(AccessFile file, WriterOptions options, Logger log)
    : file_(std::move(file)), now_(options), log_(std::move(log)), options_(options), thread_([this] {
        run();
      }) {}

Writer::~Writer() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  wake_.notify_all();
  thread_.join();
}

void Writer::audit(AuditEvent event, std::int64_t now_ns) {
  {
    const std::lock_guard lock(mutex_);
    if (events_.size() >= options_.audit.waiting) {
      ++lost_;
      return;
    }
    events_.push_back(std::move(event));
    newest_ns_ = now_ns;
  }
  wake_.notify_one();
}

void Writer::pair(const v1::Pair& request, const std::string& address, std::int64_t now_ns, Done done) {
  {
    const std::lock_guard lock(mutex_);
    if (pairings_.size() < options_.waiting_pairings && !stop_) {
      pairings_.push_back({request, address, now_ns, std::move(done)});
      wake_.notify_one();
      return;
    }
  }
  done(make_error(ErrorCode::resource_exhausted, "too many devices want to be paired at once", "pair"));
}

void Writer::set_options(WriterOptions options) {
  const std::lock_guard lock(mutex_);
  options_ = options;
}

void Writer::flush() {
  std::unique_lock lock(mutex_);
  idle_.wait(lock, [this] { return events_.empty() && pairings_.empty() && !busy_; });
}

void Writer::run() {
  std::unique_lock lock(mutex_);
  for (;;) {
    wake_.wait(lock, [this] { return stop_ || !events_.empty() || !pairings_.empty(); });
    if (events_.empty() && pairings_.empty()) return;
    busy_ = true;
    const auto events = std::exchange(events_, {});
    const std::uint64_t lost = std::exchange(lost_, 0);
    const std::int64_t now_ns = newest_ns_;
    auto pairings = std::exchange(pairings_, {});
    now_ = options_;
    lock.unlock();
    if (!events.empty()) write(events, now_ns, lost);
    for (Pairing& pairing : pairings) pairing.done(pair_now(pairing));
    lock.lock();
    busy_ = false;
    idle_.notify_all();
  }
}

void Writer::write(const std::vector<AuditEvent>& events, std::int64_t now_ns, std::uint64_t lost) {
  Status status = file_.add_audit(events, now_ns, now_.audit.entries);
  if (status && lost > 0) {
    AuditEvent told{AuditKind::suppressed};
    told.detail = fmt::format("{} events were left out: the disk was slower than they came", lost);
    status = file_.add_audit({told}, now_ns, now_.audit.entries);
  }
  if (!status) log_.error("{} audit entries are not kept: {}", events.size(), status.error().describe());
}

Status Writer::may_try(const std::string& address, std::int64_t now_ns) {
  const std::int64_t minute = now_ns / ns_per_minute;
  if (minute != minute_) {
    minute_ = minute;
    wrong_.clear();
    wrong_in_all_ = 0;
  }
  const auto found = wrong_.find(net::limited_address(address));
  if (wrong_in_all_ >= now_.wrong_codes_per_minute_in_all ||
      (found != wrong_.end() && found->second >= now_.wrong_codes_per_minute))
    return make_error(ErrorCode::resource_exhausted, "too many wrong codes: try again in a minute", "code");
  return {};
}

Result<v1::Paired> Writer::pair_now(const Pairing& pairing) {
  if (const Status may = may_try(pairing.address, pairing.now_ns); !may) return may.error();
  const auto paired = file_.pair({pairing.request.code(), pairing.request.certificate_request(),
                                  pairing.request.device(), now_.certificate_days},
                                 pairing.now_ns / ns_per_s);
  if (!paired) {
    ++wrong_[net::limited_address(
        pairing.address)];  // Of as many addresses at most as there may be wrong codes in all.
    ++wrong_in_all_;
    return paired.error();
  }
  v1::Paired answer;
  answer.set_certificate(paired->certificate_pem);
  answer.set_user(paired->device.user);
  answer.set_role(std::string(role_name(paired->role)));
  return answer;
}

}  // namespace handloft::access
