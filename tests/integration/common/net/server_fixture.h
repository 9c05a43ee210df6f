#pragma once
// A MessageServer on a real socket with an I/O thread, and what its callbacks saw.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/socket.h>

#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <condition_variable>
#include <functional>
#include <map>
#include <mutex>
#include <set>
#include <thread>
#include <vector>

#include "common/base/clock.h"
#include "common/net/message_client.h"
#include "common/net/message_server.h"
#include "proto/session.pb.h"
#include "tests/support/test_data.h"

namespace handloft::net {

inline constexpr std::chrono::milliseconds patience{10000};

class Server {
 public:
  struct Settings {
    ServerOptions options = {};
    std::string endpoint = {};  // empty: unix in a temporary folder
    std::function<Status(const ConnectionPtr&)> on_join = {};
    std::function<Status(const ConnectionPtr&, const v1::Envelope&)> on_message = {};
    std::function<OverflowAction(const ConnectionPtr&)> on_overflow = {};
  };

  Server() : Server(Settings{}) {}
  explicit Server(Settings settings) : settings_(std::move(settings)) {
    ServerEvents events;
    events.on_join = [this](const ConnectionPtr& connection) {
      if (settings_.on_join) {
        if (const Status status = settings_.on_join(connection); !status) return status;
      }
      change([&] { joined_[connection->id()] = connection; });
      return Status();
    };
    events.on_message = [this](const ConnectionPtr& connection, const v1::Envelope& message) {
      change([&] { ++messages_; });
      return settings_.on_message ? settings_.on_message(connection, message) : Status();
    };
    events.on_closed = [this](const ConnectionPtr& connection, const std::string& reason) {
      change([&] { closed_[connection->id()] = reason; });
    };
    events.on_overflow = settings_.on_overflow;
    const std::string where =
        settings_.endpoint.empty() ? "unix:" + (folder_.path() / "s").string() : settings_.endpoint;
    auto server = MessageServer::listen(io_.get_executor(), parse_endpoint(where).value(), settings_.options,
                                        events, clock_, Logger("test", LogLevel::off));
    EXPECT_TRUE(server.ok()) << server.error().describe();
    server_ = std::move(*server);
    thread_ = std::thread([this] { io_.run(); });
  }

  ~Server() {
    server_->stop();
    work_.reset();
    io_.stop();
    thread_.join();
    joined_.clear();
  }

  const Endpoint& endpoint() const { return server_->endpoint(); }
  MessageServer& operator*() { return *server_; }
  const Clock& clock() const { return clock_; }

  static ClientOptions client_options(std::string name = "tester") {
    ClientOptions options;
    options.role = v1::ROLE_EDITOR;
    options.program = "test 1";
    options.name = std::move(name);
    options.connect_timeout = std::chrono::seconds(5);
    options.retry_interval = std::chrono::milliseconds(10);
    return options;
  }
  SyncClient connect(std::string name = "tester") {
    auto client = SyncClient::connect(endpoint(), client_options(std::move(name)), clock_);
    EXPECT_TRUE(client.ok()) << client.error().describe();
    return std::move(*client);
  }

  // The connection of a client that has its Welcome; waits until on_join was called.
  ConnectionPtr connection(std::uint64_t id) {
    wait([&] { return joined_.contains(id); });
    const std::lock_guard lock(mutex_);
    return joined_[id];
  }
  std::string close_reason(std::uint64_t id) {
    wait([&] { return closed_.contains(id); });
    const std::lock_guard lock(mutex_);
    return closed_[id];
  }
  void wait_for_messages(int count) {
    wait([&] { return messages_ >= count; });
  }
  // For conditions that no callback announces; looks often.
  void wait_until(const std::function<bool()>& condition) {
    const auto deadline = std::chrono::steady_clock::now() + patience;
    while (!condition() && std::chrono::steady_clock::now() < deadline) std::this_thread::yield();
    EXPECT_TRUE(condition());
  }

 private:
  template <typename Change>
  void change(Change how) {
    const std::lock_guard lock(mutex_);
    how();
    changed_.notify_all();
  }
  template <typename Condition>
  void wait(Condition condition) {
    std::unique_lock lock(mutex_);
    EXPECT_TRUE(changed_.wait_for(lock, patience, condition));
  }

  Settings settings_;
  test::TemporaryDirectory folder_;
  SystemClock clock_;
  boost::asio::io_context io_;
  boost::asio::executor_work_guard<boost::asio::io_context::executor_type> work_{io_.get_executor()};
  std::mutex mutex_;
  std::condition_variable changed_;
  std::map<std::uint64_t, ConnectionPtr> joined_;
  std::map<std::uint64_t, std::string> closed_;
  int messages_ = 0;
  std::unique_ptr<MessageServer> server_;
  std::thread thread_;
};

// A socket without manners: sends bytes as it likes.
class RawPeer {
 public:
  explicit RawPeer(const Endpoint& endpoint) {
    auto fd = connect_to(endpoint, 5000);
    EXPECT_TRUE(fd.ok()) << fd.error().describe();
    fd_ = std::move(*fd);
  }
  void send(std::string_view bytes) {
    while (!bytes.empty()) {
      const ssize_t count = ::send(fd_.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL);
      if (count <= 0) return;  // closed by the server, as some of these deserve
      bytes.remove_prefix(static_cast<std::size_t>(count));
    }
  }
  void send(const v1::Envelope& envelope) { send(**encode_frame(envelope)); }
  // The next message, or nothing when the connection has ended.
  std::optional<v1::Envelope> receive() {
    for (;;) {
      const auto payload = decoder_.next();
      EXPECT_TRUE(payload.ok());
      if (*payload) {
        v1::Envelope envelope;
        EXPECT_TRUE(parse_envelope(**payload, envelope).ok());
        return envelope;
      }
      pollfd readable{fd_.get(), POLLIN, 0};
      if (poll(&readable, 1, static_cast<int>(patience.count())) != 1) {
        ADD_FAILURE() << "nothing came";
        return std::nullopt;
      }
      const auto room = decoder_.prepare();
      const ssize_t count = recv(fd_.get(), room.data(), room.size(), 0);
      if (count <= 0) return std::nullopt;
      decoder_.commit(static_cast<std::size_t>(count));
    }
  }
  void hang_up() { fd_.reset(); }

 private:
  FileDescriptor fd_;
  FrameDecoder decoder_;
};

inline v1::Envelope hello(std::uint32_t major = protocol_major) {
  v1::Envelope envelope;
  envelope.mutable_hello()->set_protocol_major(major);
  envelope.mutable_hello()->set_role(v1::ROLE_EDITOR);
  envelope.mutable_hello()->set_program("raw");
  return envelope;
}

inline v1::Envelope presence(const std::string& name, std::int64_t number = 0, std::size_t padding = 0) {
  v1::Envelope envelope;
  envelope.mutable_presence()->set_name(name);
  envelope.mutable_presence()->set_capture_time_ns(number);
  envelope.mutable_presence()->set_tool(std::string(padding, 'x'));
  return envelope;
}

}  // namespace handloft::net
