#pragma once
// The network between a client and a server, as bad as a test wants it: carries the bytes of real sockets
// from one to the other, and stalls, swallows or cuts them in either direction for as long as it is told.

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <mutex>
#include <thread>
#include <vector>

#include "common/net/endpoint.h"

namespace handloft::test {

class BadLink {
 public:
  enum class Fault : std::uint8_t {
    none,
    stalled,            ///< Bytes wait, in both directions; they come later, none is lost.
    stalled_to_server,  ///< Of what the client says only.
    stalled_to_client,
    swallowed,  ///< As of a router that lost its power: nothing arrives, nobody is told. mend() ends the
                ///< connections, since their bytes are gone.
    cut,        ///< Both are told at once, and who connects anew is cut as well.
  };
  static constexpr int fault_kinds = 6;

  /// Listens at `path`, and connects to `server` for each who connects. Throws std::runtime_error.
  BadLink(const std::filesystem::path& path, net::Endpoint server);
  ~BadLink();
  BadLink(const BadLink&) = delete;
  BadLink& operator=(const BadLink&) = delete;

  net::Endpoint endpoint() const { return endpoint_; }
  /// From now on, with the connections there are and those to come.
  void suffer(Fault fault);
  void mend() { suffer(Fault::none); }

  std::uint64_t connections() const { return connections_; }  ///< That there were.

 private:
  struct Direction {
    std::vector<char> waiting;  ///< Read, and not yet written.
    bool ended = false;
  };
  struct Pair {
    net::FileDescriptor client, server;
    Direction to_server, to_client;
    bool lost_bytes = false;
    bool over = false;
  };
  void run();
  void accept(Fault fault);
  void carry(Pair& pair, Fault fault);
  /// False: that end is gone.
  static bool move(int from, int to, Direction& direction);
  /// Reads what there is and forgets it. False: there was nothing.
  static bool swallow(int from, Direction& direction);

  const net::Endpoint server_;
  net::Endpoint endpoint_;
  net::FileDescriptor listener_, wake_;
  std::atomic<Fault> fault_ = Fault::none;
  std::atomic<bool> stopped_ = false;
  std::atomic<std::uint64_t> connections_ = 0;
  std::vector<Pair> pairs_;  ///< The thread's own.
  std::thread thread_;
};

}  // namespace handloft::test
