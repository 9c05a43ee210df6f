#pragma once
// The real server without sockets and threads, on a disk in memory: its peers, its model's actor and its
// store, every piece of work an event of the timeline. It can be killed at any event, between the writes of a
// commit too, and started again from what the disk then holds.

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "server-model/session/peers.h"
#include "server-model/store/model_store.h"
#include "tests/simulation/judge.h"
#include "tests/simulation/link.h"
#include "tests/simulation/timeline.h"
#include "tests/support/fault_disk.h"

namespace handloft::simulation {

struct SimulatedServerOptions {
  session::ActorOptions::Acknowledge acknowledge = session::ActorOptions::Acknowledge::durable;
  std::uint64_t snapshot_every = 40;
  int checkpoint_pages = 30;
  /// The model's thread, a thread beside it, the disk: longest piece of work.
  double model_s = 0.002, pool_s = 0.02, disk_s = 0.03;
  LinkOptions link;
  /// ClientMemory::scene_bytes: who keeps more begins anew.
  std::size_t scene_bytes = std::size_t{2} << 20;
  std::shared_ptr<access::Gate> gate = {};  ///< Null: all are owners.
  enum class Disk {
    honest,
    lies,  ///< Negative control: what it says is flushed is gone with the power.
  };
  Disk disk = Disk::honest;
};

/// Who somebody is, as a kernel or TLS says.
struct SimulatedPeer {
  std::optional<std::uint32_t> uid = {};                  ///< Of a unix socket; nullopt: the server's own.
  std::optional<net::CertificateFacts> certificate = {};  ///< Over TLS.
};

class SimulatedServer {
 public:
  SimulatedServer(Timeline& timeline, SimulatedServerOptions options, Judge& judge);
  ~SimulatedServer();
  SimulatedServer(const SimulatedServer&) = delete;
  SimulatedServer& operator=(const SimulatedServer&) = delete;

  /// From what the disk holds. A disk that cannot be opened is complained of.
  void start();
  bool up() const { return peers_ != nullptr; }
  LinkPtr connect(const v1::Hello& hello, ClientEnd end, const SimulatedPeer& peer = {});

  /// At once.
  void kill(test::Crash crash);
  /// While the next commit is being written.
  void kill_in_commit(test::Crash crash) { kill_in_commit_ = crash; }
  void let_live() { kill_in_commit_.reset(); }  ///< After all.
  /// Until the next restart.
  void break_disk(test::FaultDisk::Failure failure);
  /// As a service manager stops it.
  void stop();

  session::Peers& peers() { return *peers_; }
  /// Of a model; null: it is not open. "": the first.
  session::RoomPtr room(const std::string& model) const;
  test::FaultDisk::Files files() const { return disk_->files(); }
  std::uint64_t starts() const { return starts_; }
  bool idle() const;
  /// Brings the two figures up to date.
  void take_figures();
  /// The most work that ever waited for a thread, and bytes for a client.
  std::size_t most_waiting() const { return most_waiting_; }
  std::size_t most_queued_bytes() const { return most_queued_bytes_; }

 private:
  test::FaultDisk::Files after(test::Crash crash, std::size_t end);
  Result<session::OpenedModel> open(const std::string& file);
  std::shared_ptr<SimulatedThread> thread(double longest_s);
  void tick(std::uint64_t start);
  void in_disk(const std::function<void()>& work);
  void forget();

  Timeline& timeline_;
  const SimulatedServerOptions options_;
  Judge& judge_;
  test::FaultDisk::Files before_;  ///< When this start began.
  std::unique_ptr<test::FaultDisk> disk_;
  std::vector<std::shared_ptr<SimulatedThread>> threads_;
  std::vector<std::shared_ptr<SimulatedThread>> disk_threads_;  ///< Of `threads_`.
  std::shared_ptr<session::Peers> peers_;
  net::ServerEvents events_;
  net::ServerEvents tls_events_;
  std::vector<LinkPtr> links_;
  std::uint64_t last_number_ = 0;
  std::uint64_t starts_ = 0;
  std::optional<test::Crash> kill_in_commit_;
  std::size_t most_waiting_ = 0;
  std::size_t most_queued_bytes_ = 0;
};

}  // namespace handloft::simulation
