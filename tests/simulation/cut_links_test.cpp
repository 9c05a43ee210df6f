// C3 over real sockets: the link of each client is stalled, cut or swallows what it should carry, in either
// direction, again and again, while all work on. The clients are those of the headset: they come again by
// themselves and say what they hold. In the end all see what the server has. Long:
//
//   HANDLOFT_CUTS=5000 HANDLOFT_LONGEST_CUT_S=60 HANDLOFT_CLIENTS=100 build/release/bin/integration_cut_links

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <iostream>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "client-hmd/mirror/model_feed.h"
#include "common/net/io_thread.h"
#include "common/net/message_client.h"
#include "server-model/model/canonical.h"
#include "server-model/session/server.h"
#include "tests/simulation/random_operation.h"
#include "tests/simulation/same_scene.h"
#include "tests/simulation/timeline.h"
#include "tests/support/bad_link.h"
#include "tests/support/test_data.h"

namespace handloft::simulation {
namespace {

using namespace std::chrono_literals;
using SteadyTime = std::chrono::steady_clock::time_point;

constexpr double shortest_cut_s = 0.1;
constexpr double longest_calm_s = 0.4;  ///< Between two cuts of one link.
constexpr double edits_per_s = 200;     ///< Of all together.
/// Beyond what a client takes to notice that a link is dead (15 s), and the machine's load.
constexpr auto patience = 60s;

double number(const char* name, double otherwise) {
  const char* value = std::getenv(name);
  return value == nullptr ? otherwise : std::atof(value);
}

SteadyTime in(double seconds) {
  return std::chrono::steady_clock::now() + std::chrono::duration_cast<std::chrono::steady_clock::duration>(
                                                std::chrono::duration<double>(seconds));
}

class CutLinks : public ::testing::Test {
 protected:
  struct Client {
    std::unique_ptr<test::BadLink> link;
    std::unique_ptr<client::ModelFeed> feed;
    SteadyTime changes_at;
    bool suffers = false;
  };

  void SetUp() override {
    net::Endpoint local;
    local.path = (folder_.path() / "server").string();
    net::Endpoint tcp;
    tcp.kind = net::Endpoint::Kind::tcp;
    tcp.host = "127.0.0.1";
    session::ServerOptions options;
    options.actor.epoch = 1;
    // Coarse, so that a fit is soon to be seen.
    options.actor.meshes.tessellation.chord_tolerance_m = 1e-3;
    options.actor.meshes.tessellation.max_divisions = 8;
    auto server = session::Server::start(io_.context().get_executor(), {local, tcp}, model::Model(),
                                         std::move(options), clock_, Logger("server", LogLevel::error));
    ASSERT_TRUE(server.ok()) << server.error().describe();
    server_ = *std::move(server);
  }
  void TearDown() override {
    clients_.clear();
    server_.reset();
  }

  /// Half of them by TCP.
  void come() {
    Client client;
    const std::string number = std::to_string(clients_.size());
    client.link = std::make_unique<test::BadLink>(folder_.path() / ("link" + number),
                                                  server_->endpoints().at(clients_.size() % 2));
    client::FeedOptions options;
    options.role = v1::ROLE_EDITOR;
    options.name = "client " + number;
    options.client_key = net::random_client_key();
    client.feed =
        client::ModelFeed::start(client.link->endpoint(), clock_, Logger("client", LogLevel::off), options);
    client.changes_at = in(random_.between(0, 2 * longest_calm_s));
    clients_.push_back(std::move(client));
  }

  /// All in turn, until there were so many cuts.
  void suffer(int cuts, double longest_cut_s, std::size_t clients) {
    OperationMix mix;
    mix.undo = 0.15;
    for (SteadyTime edits_at = in(0); cuts_ < cuts;) {
      if (clients_.size() < clients && (clients_.size() < clients / 2 || random_.chance(0.02))) come();
      for (Client& client : clients_) {
        if (std::chrono::steady_clock::now() < client.changes_at) continue;
        client.suffers = !client.suffers;
        if (client.suffers) {
          ++cuts_;
          client.link->suffer(static_cast<test::BadLink::Fault>(
              1 + random_.below(static_cast<std::uint64_t>(test::BadLink::fault_kinds - 1))));
          // As many short ones as long ones, in each decade.
          client.changes_at = in(shortest_cut_s * std::pow(longest_cut_s / shortest_cut_s, random_.unit()));
        } else {
          client.link->mend();
          client.changes_at = in(random_.between(0, longest_calm_s));
        }
      }
      if (std::chrono::steady_clock::now() < edits_at) {
        std::this_thread::sleep_for(1ms);
        continue;
      }
      edits_at = in(random_.between(0, 2 / edits_per_s));
      client::ModelFeed& feed = *clients_.at(random_.below(clients_.size())).feed;
      const auto operation = random_operation(*feed.state()->scene, random_, mix);
      if (feed.submit(operation).ok()) ++edits_;
    }
  }

  /// What a client has otherwise than the server.
  std::vector<std::string> differences_of(const Client& client) {
    return differences(*client.feed->state()->scene, *server_->actor().scene());
  }

  /// What keeps the clients from all having one scene, and that the server's newest; empty: nothing. What is
  /// still on its way through a mended link changes the server yet, so that all must hold of one scene.
  std::vector<std::string> unsettled() {
    const auto served = server_->actor().scene();
    for (std::size_t i = 0; i < clients_.size(); ++i) {
      const auto state = clients_[i].feed->state();
      std::vector<std::string> others = differences(*state->scene, *served);
      if (!state->connected) others.emplace_back("connection: " + state->problem);
      if (others.empty()) continue;
      others.insert(others.begin(), "client " + std::to_string(i) + " has another");
      return others;
    }
    if (!server_->actor().idle() || server_->actor().scene() != served) return {"the server is at work"};
    return {};
  }

  net::IoThread io_;
  SystemClock clock_;
  test::TemporaryDirectory folder_;
  Random random_{20261122};
  std::unique_ptr<session::Server> server_;
  std::vector<Client> clients_;
  int cuts_ = 0;
  int edits_ = 0;
};

TEST_F(CutLinks, C3EveryClientEndsWithWhatTheServerHas) {
  const auto cuts = static_cast<int>(number("HANDLOFT_CUTS", 100));
  const double longest_s = number("HANDLOFT_LONGEST_CUT_S", 0.5);
  suffer(cuts, longest_s, static_cast<std::size_t>(number("HANDLOFT_CLIENTS", 12)));
  for (Client& client : clients_) client.link->mend();
  server_->actor().settle();

  const SteadyTime begun = std::chrono::steady_clock::now();
  std::vector<std::string> left = unsettled();
  while (!left.empty() && std::chrono::steady_clock::now() < begun + patience) {
    std::this_thread::sleep_for(5ms);
    left = unsettled();
  }
  EXPECT_TRUE(left.empty()) << ::testing::PrintToString(left);
  std::uint64_t connects = 0, snapshots = 0;
  for (const Client& client : clients_) {
    connects += client.feed->statistics().connects;
    snapshots += client.feed->state()->snapshots;
  }
  const double slowest_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
  const session::ActorState state = server_->actor().state();
  std::cout << cuts_ << " cuts of 0.1 to " << longest_s << " s of " << clients_.size() << " clients' links, "
            << edits_ << " operations sent, " << state.sequence << " applied: " << connects
            << " connections, " << connects - snapshots << " of them resumed; "
            << (left.empty() ? "all have" : "NOT all have") << " what the server has (" << state.hash
            << ") after " << slowest_s << " s\n";
  EXPECT_EQ(cuts_, cuts);
  EXPECT_GT(state.sequence, 50U);
  // A test without connections that break shows nothing, nor one in which all begin anew.
  EXPECT_GT(connects, clients_.size() + static_cast<std::size_t>(cuts) / 8);
  EXPECT_GT(connects - snapshots, (connects - clients_.size()) / 2);
}

TEST_F(CutLinks, NegativeControlWhoIsStillCutOffHasSomethingElse) {
  come();
  come();
  v1::Operation operation;
  operation.mutable_create_dual_shape()->set_id("before");
  const auto all_have = [&](std::uint64_t sequence) {
    return std::all_of(clients_.begin(), clients_.end(), [&](const Client& client) {
      return client.feed->state()->scene->sequence >= sequence;
    });
  };
  const SteadyTime deadline = std::chrono::steady_clock::now() + patience;
  while (!clients_[0].feed->submit(operation).ok() && std::chrono::steady_clock::now() < deadline)
    std::this_thread::sleep_for(1ms);
  while (!all_have(1) && std::chrono::steady_clock::now() < deadline) std::this_thread::sleep_for(1ms);
  ASSERT_TRUE(all_have(1));
  clients_[1].link->suffer(test::BadLink::Fault::swallowed);
  operation.mutable_create_dual_shape()->set_id("after");
  ASSERT_TRUE(clients_[0].feed->submit(operation).ok());
  while (clients_[0].feed->state()->scene->sequence < 2 && std::chrono::steady_clock::now() < deadline)
    std::this_thread::sleep_for(1ms);
  EXPECT_TRUE(differences_of(clients_[0]).empty());
  EXPECT_FALSE(differences_of(clients_[1]).empty());
}

}  // namespace
}  // namespace handloft::simulation
