#include "tests/simulation/simulated_server.h"

#include <unistd.h>

#include <utility>

namespace handloft::simulation {
namespace {

constexpr const char* model_file = "model";
constexpr double tick_s = 0.25;

/// What connections are numbered by who have no key: others with every start.
constexpr std::uint64_t start_shift = 40;

}  // namespace

SimulatedServer::SimulatedServer(Timeline& timeline, SimulatedServerOptions options, Judge& judge)
    : timeline_(timeline), options_(std::move(options)), judge_(judge) {}

SimulatedServer::~SimulatedServer() {
  forget();
}

void SimulatedServer::start() {
  if (up()) return;
  ++starts_;
  disk_ = std::make_unique<test::FaultDisk>(before_);
  model_ = std::make_shared<SimulatedThread>(timeline_, options_.model_s);
  pool_ = std::make_shared<SimulatedThread>(timeline_, options_.pool_s);
  snapshots_ = std::make_shared<SimulatedThread>(timeline_, options_.pool_s);
  writer_ = std::make_shared<SimulatedThread>(timeline_, options_.disk_s,
                                              [this](const auto& work) { in_disk(work); });
  store::ModelStoreOptions store_options;
  store_options.log.vfs = disk_->name();
  store_options.log.mark = store::LogOptions::Mark::none;
  store_options.log.checkpoint_pages = options_.checkpoint_pages;
  store_options.commit.queue = writer_;
  store_options.snapshots = snapshots_;
  store_options.snapshot_every = options_.snapshot_every;
  store_options.now_ns = [this] { return to_ns(timeline_.now()); };
  auto opened = store::ModelStore::open(model_file, {}, std::move(store_options));
  if (!opened) {
    judge_.complain("start " + std::to_string(starts_) + ": " + opened.error().describe());
    return;
  }
  store_ = opened->store;
  session::ServerOptions options;
  options.actor.threads = [this] { return session::ActorThreads{model_, pool_}; };
  options.actor.store = store_;
  options.actor.acknowledge = options_.acknowledge;
  options.actor.epoch = starts_;
  options.rooms.queue = std::make_shared<SimulatedThread>(timeline_, options_.pool_s);
  options.wall_ns = [this] { return to_ns(timeline_.now()); };
  options.actor.meshes.tessellation.chord_tolerance_m = 1e-3;
  options.actor.meshes.tessellation.max_divisions = 8;
  peers_ = session::Peers::start(std::move(opened->model), std::move(options), timeline_.clock(),
                                 Logger("simulation", LogLevel::off));
  events_ = peers_->events(net::Endpoint::Kind::unix_socket);
  tick(starts_);
}

void SimulatedServer::tick(std::uint64_t start) {
  timeline_.after(tick_s, [this, start] {
    if (!up() || start != starts_) return;
    peers_->tick();
    tick(start);
  });
}

LinkPtr SimulatedServer::connect(const v1::Hello& hello, ClientEnd end) {
  if (!up()) return nullptr;
  net::PeerInfo info;
  info.role = hello.role();
  info.program = "simulation";
  info.name = hello.name();
  info.protocol_minor = net::protocol_minor;
  info.hello_received = timeline_.now();
  info.client_key = hello.client_key();
  info.uid = ::getuid();
  std::uint64_t id = (starts_ << start_shift) + ++last_number_;
  if (events_.admit) {
    const auto admission = events_.admit(info);
    if (!admission) return nullptr;
    if (admission->client_id != 0) id = admission->client_id;
  }
  const auto link =
      std::make_shared<Link>(timeline_, options_.link, events_, id, std::move(info), std::move(end));
  std::erase_if(links_, [](const LinkPtr& old) { return old->closed(); });
  links_.push_back(link);
  return link->begin() ? link : nullptr;
}

test::FaultDisk::Files SimulatedServer::after(test::Crash crash, std::size_t end) {
  const std::uint64_t chance = timeline_.random().next();
  if (options_.disk == SimulatedServerOptions::Disk::honest)
    return test::after_crash(before_, disk_->events(), end, crash, chance);
  std::vector<test::FaultDisk::Event> events = disk_->events();
  events.resize(end);
  std::erase_if(events, [](const auto& event) { return event.kind == test::FaultDisk::Event::Kind::flush; });
  return test::after_crash(before_, events, events.size(), crash, chance);
}

void SimulatedServer::in_disk(const std::function<void()>& work) {
  if (!kill_in_commit_ || store_ == nullptr) {
    work();
    return;
  }
  const test::Crash crash = *std::exchange(kill_in_commit_, std::nullopt);
  // What it would say, nobody hears.
  for (const LinkPtr& link : links_) link->server_dies(timeline_.random().between(0, 5));
  const std::size_t begun = disk_->events().size();
  work();
  const std::size_t end = begun + timeline_.random().below(disk_->events().size() - begun + 1);
  before_ = after(crash, end);
  timeline_.after(0, [this] { forget(); });
}

void SimulatedServer::kill(test::Crash crash) {
  if (!up()) return;
  for (const LinkPtr& link : links_) link->server_dies(timeline_.random().between(0, 5));
  before_ = after(crash, disk_->events().size());
  forget();
}

void SimulatedServer::stop() {
  if (!up()) return;
  for (const LinkPtr& link : links_) link->server_dies(timeline_.random().between(0, 0.1));
  peers_->stop();
  store_->stop();
  before_ = disk_->files();
  forget();
}

void SimulatedServer::break_disk(test::FaultDisk::Failure failure) {
  if (up()) disk_->fail_at(timeline_.random().below(20), failure);
}

void SimulatedServer::take_figures() {
  for (const auto& thread : {model_, pool_, writer_, snapshots_}) {
    if (thread) most_waiting_ = std::max(most_waiting_, thread->most_waiting());
  }
  for (const LinkPtr& link : links_)
    most_queued_bytes_ = std::max(most_queued_bytes_, link->most_queued_bytes());
}

/// A process that is gone writes nothing any more, and nothing of it is called.
void SimulatedServer::forget() {
  take_figures();
  kill_in_commit_.reset();
  if (disk_) disk_->fail_at(0, test::FaultDisk::Failure::error_for_good);
  for (const auto& thread : {model_, pool_, writer_, snapshots_}) {
    if (thread) thread->stop();
  }
  links_.clear();
  events_ = {};
  peers_.reset();
  store_.reset();
  disk_.reset();
}

bool SimulatedServer::idle() const {
  return up() && peers_->actor().idle() && writer_->waiting() == 0 && snapshots_->waiting() == 0;
}

}  // namespace handloft::simulation
