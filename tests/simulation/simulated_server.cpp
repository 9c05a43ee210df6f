#include "tests/simulation/simulated_server.h"

#include <unistd.h>

#include <algorithm>
#include <utility>

namespace handloft::simulation {
namespace {

constexpr const char* model_file = "model";
/// There is no such folder: the files are on the simulated disk, by their models' names.
constexpr const char* other_models = "/handloft-simulation";
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
  if (options_.gate) (void)options_.gate->poll();  // A process that begins reads who may do what.
  auto opened = open(model_file);
  if (!opened) {
    judge_.complain("start " + std::to_string(starts_) + ": " + opened.error().describe());
    return;
  }
  session::ServerOptions options;
  options.actor.threads = [this] {
    return session::ActorThreads{thread(options_.model_s), thread(options_.pool_s)};
  };
  options.actor.store = opened->store;
  options.actor.acknowledge = options_.acknowledge;
  options.actor.epoch = starts_;
  options.rooms.queue = thread(options_.pool_s);
  options.rooms.folder = other_models;
  options.rooms.open = [this](const std::filesystem::path& path) { return open(path.stem().string()); };
  options.client_memory.scene_bytes = options_.scene_bytes;
  options.gate = options_.gate;
  options.wall_ns = [this] { return to_ns(timeline_.now()); };
  options.actor.meshes.tessellation.chord_tolerance_m = 1e-3;
  options.actor.meshes.tessellation.max_divisions = 8;
  peers_ = session::Peers::start(std::move(opened->model), std::move(options), timeline_.clock(),
                                 Logger("simulation", LogLevel::off));
  events_ = peers_->events(net::Endpoint::Kind::unix_socket);
  tls_events_ = peers_->events(net::Endpoint::Kind::tls);
  tick(starts_);
}

std::shared_ptr<SimulatedThread> SimulatedServer::thread(double longest_s) {
  threads_.push_back(std::make_shared<SimulatedThread>(timeline_, longest_s));
  return threads_.back();
}

Result<session::OpenedModel> SimulatedServer::open(const std::string& file) {
  const auto snapshots = thread(options_.pool_s);
  const auto writer = std::make_shared<SimulatedThread>(timeline_, options_.disk_s,
                                                        [this](const auto& work) { in_disk(work); });
  threads_.push_back(writer);
  disk_threads_.push_back(writer);
  disk_threads_.push_back(snapshots);
  store::ModelStoreOptions options;
  options.log.vfs = disk_->name();
  options.log.mark = store::LogOptions::Mark::none;
  options.log.checkpoint_pages = options_.checkpoint_pages;
  options.commit.queue = writer;
  options.snapshots = snapshots;
  options.snapshot_every = options_.snapshot_every;
  options.now_ns = [this] { return to_ns(timeline_.now()); };
  auto opened = store::ModelStore::open(file, {}, std::move(options));
  if (!opened) return opened.error();
  return session::OpenedModel{std::move(opened->model), std::move(opened->store)};
}

session::RoomPtr SimulatedServer::room(const std::string& model) const {
  if (!up()) return nullptr;
  if (model.empty()) return peers_->rooms().first();
  for (const session::RoomPtr& room : peers_->rooms().open_rooms()) {
    if (room->name == model) return room;
  }
  return nullptr;
}

void SimulatedServer::tick(std::uint64_t start) {
  timeline_.after(tick_s, [this, start] {
    if (!up() || start != starts_) return;
    peers_->tick();
    tick(start);
  });
}

LinkPtr SimulatedServer::connect(const v1::Hello& hello, ClientEnd end, const SimulatedPeer& peer) {
  if (!up()) return nullptr;
  net::PeerInfo info;
  info.role = hello.role();
  info.program = "simulation";
  info.name = hello.name();
  info.protocol_minor = net::protocol_minor;
  info.hello_received = timeline_.now();
  info.client_key = hello.client_key();
  info.certificate = peer.certificate;
  if (peer.certificate) {
    info.address = "192.0.2.7";
  } else {
    info.uid = peer.uid.value_or(::getuid());
  }
  const net::ServerEvents& events = peer.certificate ? tls_events_ : events_;
  std::uint64_t id = (starts_ << start_shift) + ++last_number_;
  if (events.admit) {
    const auto admission = events.admit(info);
    if (!admission) return nullptr;
    if (admission->client_id != 0) id = admission->client_id;
  }
  const auto link =
      std::make_shared<Link>(timeline_, options_.link, events, id, std::move(info), std::move(end));
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
  if (!kill_in_commit_ || peers_ == nullptr) {
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
  before_ = disk_->files();
  forget();
}

void SimulatedServer::break_disk(test::FaultDisk::Failure failure) {
  if (up()) disk_->fail_at(timeline_.random().below(20), failure);
}

void SimulatedServer::take_figures() {
  for (const auto& thread : threads_) most_waiting_ = std::max(most_waiting_, thread->most_waiting());
  for (const LinkPtr& link : links_)
    most_queued_bytes_ = std::max(most_queued_bytes_, link->most_queued_bytes());
}

/// A process that is gone writes nothing any more, and nothing of it is called.
void SimulatedServer::forget() {
  take_figures();
  kill_in_commit_.reset();
  if (disk_) disk_->fail_at(0, test::FaultDisk::Failure::error_for_good);
  for (const auto& thread : threads_) thread->stop();
  threads_.clear();
  disk_threads_.clear();
  links_.clear();
  events_ = {};
  peers_.reset();
  disk_.reset();
}

bool SimulatedServer::idle() const {
  if (!up()) return false;
  for (const session::RoomPtr& room : peers_->rooms().open_rooms()) {
    if (!room->actor->idle()) return false;
  }
  return std::all_of(disk_threads_.begin(), disk_threads_.end(),
                     [](const auto& thread) { return thread->waiting() == 0; });
}

}  // namespace handloft::simulation
