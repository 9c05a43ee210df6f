#pragma once
// A server that keeps to nothing: a real socket whose connections are served by a function that may send any
// bytes. What a client made of them is seen from its answer to a Ping, or from its hanging up: nothing waits
// for a while and hopes.

#include <atomic>
#include <chrono>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <thread>

#include "common/net/endpoint.h"
#include "common/net/framing.h"
#include "proto/session.pb.h"

namespace handloft::test {

/// How long anything may take before the test has failed.
inline constexpr std::chrono::seconds hostile_patience{30};

/// One client that has connected.
class HostileConnection {
 public:
  /// `stop`: becomes readable when nobody waits for anything any more.
  HostileConnection(net::FileDescriptor socket, int stop) : socket_(std::move(socket)), stop_(stop) {}

  /// The next message; nullopt when the client hung up or nothing came in time.
  std::optional<v1::Envelope> receive();
  /// Passes over everything before a message that `wanted` accepts; false when none came.
  bool receive_until(const std::function<bool(const v1::Envelope&)>& wanted);
  /// Reads the Hello and answers it as a good server would.
  bool greet();
  bool wait_for_join();
  /// Sends a Ping behind what was sent before and waits for its Pong: true when the client has read it all
  /// and lives on, false when it hung up.
  bool survives();
  /// Answers the client's Pings until it hangs up or the server ends.
  void hold();

  // False: the client hung up.
  bool send(const v1::Envelope& envelope);
  bool send_bytes(std::string_view bytes);

 private:
  bool wait_for(short events);

  net::FileDescriptor socket_;
  int stop_;
  net::FrameDecoder decoder_;
  std::uint64_t pings_ = 0;
};

class HostileServer {
 public:
  /// Called for one connection after another, on the server's thread; the connection closes when it returns.
  using Serve = std::function<void(HostileConnection&)>;

  HostileServer(const net::Endpoint& endpoint, Serve serve);
  ~HostileServer();
  HostileServer(const HostileServer&) = delete;
  HostileServer& operator=(const HostileServer&) = delete;

 private:
  void run();

  Serve serve_;
  std::optional<net::Listener> listener_;
  net::FileDescriptor stop_;
  std::thread thread_;
};

}  // namespace handloft::test
