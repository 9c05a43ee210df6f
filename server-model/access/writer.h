#pragma once
// What a running server writes into its access file, by a thread of its own: audit entries, many in one
// transaction, and pairings one after another. Thread-safe; what waits is bounded.

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "common/base/log.h"
#include "common/base/result.h"
#include "proto/session.pb.h"
#include "server-model/access/access_file.h"
#include "server-model/access/audit.h"

namespace handloft::access {

struct WriterOptions {
  AuditLimits audit;
  int certificate_days = 730;
  std::uint32_t wrong_codes_per_minute = 5;
  std::uint32_t wrong_codes_per_minute_in_all = 300;
  std::size_t waiting_pairings = 256;
};

class Writer {
 public:
  Writer(AccessFile file, WriterOptions options, Logger log);
  /// Writes what waits.
  ~Writer();
  Writer(const Writer&) = delete;
  Writer& operator=(const Writer&) = delete;

  void audit(AuditEvent event, std::int64_t now_ns);
  using Done = std::function<void(Result<v1::Paired>)>;
  /// `done` comes from the writer's thread, or from this call when too many wait.
  void pair(const v1::Pair& request, const std::string& address, std::int64_t now_ns, Done done);
  void flush();
  /// For what is written from now on.
  void set_options(WriterOptions options);

 private:
  struct Pairing {
    v1::Pair request;
    std::string address;
    std::int64_t now_ns = 0;
    Done done;
  };

  void run();
  void write(const std::vector<AuditEvent>& events, std::int64_t now_ns, std::uint64_t lost);
  Result<v1::Paired> pair_now(const Pairing& pairing);
  Status may_try(const std::string& address, std::int64_t now_ns);

  AccessFile file_;    ///< Of the thread, as the following to wrong_in_all_.
  WriterOptions now_;  ///< The options when it woke.
  Logger log_;
  std::int64_t minute_ = 0;
  std::map<std::string, std::uint32_t> wrong_;  ///< In this minute, by address.
  std::uint32_t wrong_in_all_ = 0;

  std::mutex mutex_;  ///< Guards what follows.
  WriterOptions options_;
  std::condition_variable wake_, idle_;
  std::vector<AuditEvent> events_;
  std::int64_t newest_ns_ = 0;
  std::uint64_t lost_ = 0;
  std::deque<Pairing> pairings_;
  bool busy_ = false;
  bool stop_ = false;
  std::thread thread_;
};

}  // namespace handloft::access
