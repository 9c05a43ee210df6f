// D1 with the real program: `handloft-modeld serve --store` is killed (SIGKILL) at any moment while several
// editors work, again and again; every operation that was acknowledged is in the log, once and at its place,
// and the next start serves what the log, replayed, gives. HANDLOFT_LONG=1: 2,000 times instead of 100;
// HANDLOFT_LOOPS: as many as it says.

#include <gtest/gtest.h>
#include <signal.h>

#include <atomic>
#include <chrono>
#include <cstdlib>
#include <deque>
#include <iostream>
#include <map>
#include <memory>
#include <mutex>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "common/net/message_client.h"
#include "server-model/model/canonical.h"
#include "server-model/session/remote_target.h"
#include "server-model/store/recovery.h"
#include "tests/support/build_kind.h"
#include "tests/support/process.h"
#include "tests/support/test_data.h"

namespace handloft::simulation {
namespace {

using namespace std::chrono_literals;
namespace fs = std::filesystem;

constexpr auto patience = 30s;
constexpr int editors = 4;
constexpr std::size_t most_unanswered = 16;
constexpr int loops_of_a_file = 10;

/// What was acknowledged, by the operation's number and the place that was told.
class Acknowledged {
 public:
  void add(std::uint64_t op, std::uint64_t sequence) {
    const std::lock_guard lock(mutex_);
    places_[op] = sequence;
  }
  std::map<std::uint64_t, std::uint64_t> all() const {
    const std::lock_guard lock(mutex_);
    return places_;
  }
  void clear() {
    const std::lock_guard lock(mutex_);
    places_.clear();
  }

 private:
  mutable std::mutex mutex_;
  std::map<std::uint64_t, std::uint64_t> places_;
};

/// Sends as fast as it is answered. An operation's number is its request's as well.
class Editor {
 public:
  Editor(const net::Endpoint& endpoint, std::string entity, std::atomic<std::uint64_t>& numbers,
         Acknowledged& acknowledged, const Clock& clock)
      : entity_(std::move(entity)), numbers_(numbers), acknowledged_(acknowledged) {
    net::ClientOptions options;
    options.role = v1::ROLE_EDITOR;
    options.name = entity_;
    net::ClientEvents events;
    events.on_message = [this](v1::Envelope& envelope) {
      if (!envelope.has_ack()) return;
      if (!envelope.ack().has_failure()) {
        acknowledged_.add(envelope.ack().request(), envelope.ack().sequence());
      } else {
        ++refused_;
      }
      send_one();
    };
    auto client = net::MessageClient::connect(endpoint, std::move(options), std::move(events), clock,
                                              Logger("editor", LogLevel::off));
    if (client) client_ = *std::move(client);
  }
  bool connected() const { return client_ != nullptr; }
  void begin() {
    for (std::size_t i = 0; i < most_unanswered; ++i) send_one();
  }
  std::uint64_t refused() const { return refused_; }

 private:
  void send_one() {
    const std::uint64_t number = ++numbers_;
    v1::Envelope envelope;
    v1::Submit& submit = *envelope.mutable_submit();
    submit.set_request(number);
    submit.mutable_operation()->set_client_op_id(number);
    auto& request = *submit.mutable_operation()->mutable_add_points();
    request.set_entity(entity_);
    for (int i = 0; i < 4; ++i) {
      v1::Point& point = *request.add_points();
      point.mutable_position()->set_x(0.01 * i);
      point.mutable_position()->set_y(1e-5 * static_cast<double>(number % 10'000));
      point.set_pressure(0.5);
    }
    (void)client_->send(envelope);
  }

  const std::string entity_;
  std::atomic<std::uint64_t>& numbers_;
  Acknowledged& acknowledged_;
  std::atomic<std::uint64_t> refused_ = 0;
  std::unique_ptr<net::MessageClient> client_;
};

struct KillServed : ::testing::Test {
  test::TemporaryDirectory folder;
  SystemClock clock;
  std::atomic<std::uint64_t> numbers = 0;
  Acknowledged acknowledged;

  fs::path socket() const { return folder.path() / "model.sock"; }
  net::Endpoint endpoint() const { return net::parse_endpoint("unix:" + socket().string()).value(); }
  std::string hash_served() {
    auto target = session::RemoteTarget::connect(endpoint(), clock);
    if (!target) return target.error().describe();
    v1::Query query;
    query.mutable_hash();
    const auto answer = target->query(query);
    return answer ? answer->hash().sha256() : answer.error().describe();
  }
  /// What an entity is drawn on must be there.
  void create(const std::string& entity) {
    auto target = session::RemoteTarget::connect(endpoint(), clock);
    ASSERT_TRUE(target.ok());
    v1::Operation operation;
    operation.set_client_op_id(++numbers);
    operation.mutable_create_dual_shape()->set_id(entity);
    const auto done = target->submit(operation);
    ASSERT_TRUE(done.ok()) << done.error().describe();
    acknowledged.add(operation.client_op_id(), done->sequence);
  }
  /// Returns the hash of what the log, replayed from its start, gives.
  std::string check_log(const fs::path& path) const {
    const auto log = store::OperationLog::open(path, store::OperationLog::Access::read);
    if (!log) return log.error().describe();
    std::map<std::uint64_t, std::uint64_t> places;
    const Status read = log->read(1, [&](const store::LogEntry& entry) -> Status {
      EXPECT_TRUE(places.emplace(entry.record.client_op_id, entry.record.sequence).second)
          << "operation " << entry.record.client_op_id << " is there twice";
      return {};
    });
    EXPECT_TRUE(read.ok()) << (read.ok() ? "" : read.error().describe());
    std::uint64_t lost = 0;
    for (const auto& [op, sequence] : acknowledged.all()) {
      const auto place = places.find(op);
      if (place == places.end() || place->second != sequence) ++lost;
    }
    EXPECT_EQ(lost, 0U) << "acknowledged and lost, of " << acknowledged.all().size();
    store::RecoveryOptions how;
    how.snapshots = store::RecoveryOptions::Snapshots::ignored;
    const auto replayed = store::recover(*log, {}, how);
    return replayed ? model::document_hash(replayed->model.document()) : replayed.error().describe();
  }
};

TEST_F(KillServed, D1NothingAcknowledgedIsLost) {
  const char* wanted = std::getenv("HANDLOFT_LOOPS");
  const int loops = wanted != nullptr                         ? std::atoi(wanted)
                    : std::getenv("HANDLOFT_LONG") != nullptr ? 2000
                    : test::sanitized                         ? 20
                                                              : 100;
  std::random_device entropy;
  const std::uint64_t seed = entropy();
  std::mt19937_64 random(seed);
  std::uint64_t total = 0, refused = 0;
  fs::path path;
  std::string hash;
  for (int loop = 0; loop < loops && !HasFailure(); ++loop) {
    if (loop % loops_of_a_file == 0) {
      if (!path.empty()) fs::remove(path);
      path = folder.path() / ("model-" + std::to_string(loop) + ".handloft");
      acknowledged.clear();
      hash.clear();
    }
    test::Process server(
        {HANDLOFT_MODELD, "serve", "--listen", endpoint().to_string(), "--store", path.string()},
        folder.path() / "log");
    ASSERT_TRUE(server.read_line(patience)) << server.error_output();
    if (hash.empty()) {
      for (int i = 0; i < editors; ++i) create("shape-of-" + std::to_string(i));
    } else {
      EXPECT_EQ(hash_served(), hash) << "seed " << seed << ", loop " << loop;
    }
    {
      std::vector<std::unique_ptr<Editor>> people;
      for (int i = 0; i < editors; ++i) {
        people.push_back(std::make_unique<Editor>(endpoint(), "shape-of-" + std::to_string(i), numbers,
                                                  acknowledged, clock));
        ASSERT_TRUE(people.back()->connected());
      }
      for (const auto& person : people) person->begin();
      // The moment is the point here: nothing waits for anything.
      std::this_thread::sleep_for(std::chrono::microseconds(random() % 120'000));
      server.signal(SIGKILL);
      server.wait(patience);
      for (const auto& person : people) refused += person->refused();
    }
    const std::size_t before = total;
    total = before + acknowledged.all().size();
    hash = check_log(path);
    EXPECT_FALSE(HasFailure()) << "seed " << seed << ", loop " << loop;
  }
  std::cout << loops << " kills; acknowledged operations looked for " << total << " times, " << refused
            << " refused, 0 lost\n";
  EXPECT_GT(total, static_cast<std::uint64_t>(loops) * 10);
  EXPECT_EQ(refused, 0U);
}

}  // namespace
}  // namespace handloft::simulation
