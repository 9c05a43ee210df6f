#include "common/net/paired_server.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>

#include "common/net/client_handshake.h"
#include "common/net/pairing_code.h"
#include "proto/session.pb.h"

namespace handloft::net {

namespace fs = std::filesystem;

namespace {

constexpr std::size_t largest_file = 64U << 10;
constexpr std::size_t most_servers = 1000;
constexpr std::string_view key_file = "key.pem", certificate_file = "certificate.pem",
                           authority_file = "authority.pem", facts_file = "server.json";

Error io_error(const fs::path& path, std::string_view doing) {
  return make_error(ErrorCode::io, fmt::format("{} \"{}\": {}", doing, path.string(), std::strerror(errno)),
                    "servers");
}

Status make_private_folder(const fs::path& folder) {
  std::error_code failed;
  fs::create_directories(folder.parent_path(), failed);
  if (::mkdir(folder.c_str(), 0700) != 0 && errno != EEXIST) return io_error(folder, "cannot make");
  if (::chmod(folder.c_str(), 0700) != 0) return io_error(folder, "cannot protect");
  return {};
}

/// Whole or not at all, and never readable by others in between.
Status write_private(const fs::path& path, const std::string& content) {
  const fs::path aside = path.string() + ".new";
  ::unlink(aside.c_str());
  const FileDescriptor fd(::open(aside.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW, 0600));
  if (!fd.valid()) return io_error(aside, "cannot write");
  std::size_t done = 0;
  while (done < content.size()) {
    const ssize_t count = ::write(fd.get(), content.data() + done, content.size() - done);
    if (count <= 0 && errno != EINTR) return io_error(aside, "cannot write");
    if (count > 0) done += static_cast<std::size_t>(count);
  }
  if (::fsync(fd.get()) != 0 || ::rename(aside.c_str(), path.c_str()) != 0)
    return io_error(path, "cannot write");
  return {};
}

std::optional<std::string> read_small(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::string content(largest_file, '\0');
  file.read(content.data(), static_cast<std::streamsize>(content.size()));
  if (file.gcount() <= 0 || !file.eof()) return std::nullopt;
  content.resize(static_cast<std::size_t>(file.gcount()));
  return content;
}

std::optional<PairedServer> read_server(const fs::path& folder) {
  const auto key = read_small(folder / key_file), certificate = read_small(folder / certificate_file),
             authority = read_small(folder / authority_file), facts = read_small(folder / facts_file);
  if (!key || !certificate || !authority || !facts) return std::nullopt;
  const auto said = nlohmann::json::parse(*facts, nullptr, false);
  if (!said.is_object()) return std::nullopt;
  const auto text = [&said](const char* name) {
    const auto found = said.find(name);
    return found != said.end() && found->is_string() ? found->get<std::string>() : std::string();
  };
  return PairedServer{folder.filename().string(), text("endpoint"), text("user"), text("role"),
                      {*certificate, *key},       *authority};
}

std::string host_name() {
  std::array<char, 65> name{};
  if (::gethostname(name.data(), name.size() - 1) != 0 || name[0] == '\0') return "device";
  return name.data();
}

Status save(const PairedServer& server, const fs::path& folder) {
  if (auto made = make_private_folder(folder); !made) return made;
  const fs::path own = folder / server.authority_fingerprint;
  if (auto made = make_private_folder(own); !made) return made;
  const nlohmann::ordered_json facts{
      {"endpoint", server.endpoint}, {"user", server.user}, {"role", server.role}};
  const std::array<std::pair<std::string_view, std::string>, 4> files{
      std::pair(authority_file, server.authority_pem), std::pair(key_file, server.identity.key_pem),
      std::pair(certificate_file, server.identity.certificate_pem),
      std::pair(facts_file,
                facts.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n")};
  for (const auto& [name, content] : files) {
    if (auto written = write_private(own / name, content); !written) return written;
  }
  return {};
}

/// What the server answers to the code.
Result<v1::Paired> ask(Link& link, const std::string& code, const std::string& request,
                       const std::string& device, SteadyTime deadline) {
  v1::Envelope envelope;
  envelope.mutable_pair()->set_code(code);
  envelope.mutable_pair()->set_certificate_request(request);
  envelope.mutable_pair()->set_device(device);
  const auto frame = encode_frame(envelope, hello_max_frame_bytes);
  if (!frame) return frame.error();
  const Status said = send_all(link, **frame, deadline);
  FrameDecoder decoder(largest_file);
  if (const Status status = receive_one(link, decoder, envelope, deadline); !status)
    return said.ok() ? status.error() : said.error();
  if (envelope.has_failure()) return error_of(envelope.failure());
  if (!envelope.has_paired())
    return make_error(ErrorCode::data_corrupt, "the server's answer is not that it has paired us", "paired");
  return envelope.paired();
}

}  // namespace

Result<fs::path> paired_servers_folder() {
  const char* config = std::getenv("XDG_CONFIG_HOME");
  if (config != nullptr && config[0] == '/') return fs::path(config) / "handloft" / "servers";
  const char* home = std::getenv("HOME");
  if (home == nullptr || home[0] != '/')
    return make_error(ErrorCode::not_found, "neither XDG_CONFIG_HOME nor HOME is set", "servers");
  return fs::path(home) / ".config" / "handloft" / "servers";
}

Result<PairedServer> pair(const Endpoint& endpoint, std::string_view code, const PairingOptions& options,
                          const fs::path& folder) {
  if (endpoint.kind != Endpoint::Kind::tls)
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found \"{}\", expected tls:HOST:PORT", endpoint.to_string()), "endpoint");
  const auto read = read_pairing_code(code);
  if (!read) return read.error();
  const std::string device = options.device.empty() ? host_name() : options.device;
  const auto key = make_key();
  if (!key) return key.error();
  const auto request = make_certificate_request(*key, device);
  if (!request) return request.error();
  const auto context = TlsContext::for_pairing(read->authority);
  if (!context) return context.error();

  const SteadyTime deadline = std::chrono::steady_clock::now() + options.timeout;
  auto fd = connect_to(endpoint, static_cast<int>(options.timeout.count()));
  if (!fd) return fd.error();
  Link link{std::move(*fd), nullptr, true};
  auto stream = (*context)->open(link.fd.get());
  if (!stream) return stream.error();
  link.stream = std::move(*stream);
  const auto paired = ask(link, write_pairing_code(*read), *request, device, deadline);
  if (!paired) return paired.error();

  PairedServer server;
  server.authority_pem = TlsContext::shown_authority(*link.stream);
  const auto authority = read_certificate(server.authority_pem);
  if (!authority) return authority.error();
  server.authority_fingerprint = authority->fingerprint;
  server.endpoint = endpoint.to_string();
  server.user = paired->user();
  server.role = paired->role();
  server.identity = {paired->certificate(), *key};
  // That what came is a certificate of our own key, before it replaces what we have.
  if (const auto usable = TlsContext::for_client(server.identity, server.authority_pem); !usable)
    return usable.error();
  if (const Status saved = save(server, folder); !saved) return saved.error();
  return server;
}

std::vector<PairedServer> paired_servers(const fs::path& folder) {
  std::vector<PairedServer> servers;
  std::error_code failed;
  for (fs::directory_iterator entry(folder, failed), end;
       !failed && entry != end && servers.size() < most_servers; entry.increment(failed)) {
    if (auto server = read_server(entry->path())) servers.push_back(*std::move(server));
  }
  std::sort(servers.begin(), servers.end(), [](const PairedServer& a, const PairedServer& b) {
    return a.authority_fingerprint < b.authority_fingerprint;
  });
  return servers;
}

Result<PairedServer> find_paired_server(const Endpoint& endpoint, const fs::path& folder) {
  std::vector<PairedServer> servers = paired_servers(folder);
  const std::string wanted = endpoint.to_string();
  auto found = std::find_if(servers.begin(), servers.end(),
                            [&](const PairedServer& server) { return server.endpoint == wanted; });
  if (found == servers.end() && servers.size() == 1) found = servers.begin();
  if (found == servers.end()) {
    return make_error(
        ErrorCode::failed_precondition,
        fmt::format("this device is not paired with {}: ask who runs it for an invitation, then "
                    "\"handloft-hmd --pair CODE --model {}\" or \"handloft-modeld pair CODE --connect {}\"",
                    wanted, wanted, wanted),
        "endpoint");
  }
  const fs::path key = folder / found->authority_fingerprint / key_file;
  struct stat facts {};
  if (::stat(key.c_str(), &facts) != 0) return io_error(key, "cannot look at");
  constexpr mode_t others = S_IRWXG | S_IRWXO;
  if ((facts.st_mode & others) != 0 || facts.st_uid != ::geteuid())
    return make_error(ErrorCode::permission_denied,
                      fmt::format("\"{}\" is not ours alone: expected mode 0600", key.string()), "servers");
  return *std::move(found);
}

Result<std::shared_ptr<const TlsContext>> tls_to(const Endpoint& endpoint) {
  if (endpoint.kind != Endpoint::Kind::tls) return std::shared_ptr<const TlsContext>();
  const auto folder = paired_servers_folder();
  if (!folder) return folder.error();
  const auto server = find_paired_server(endpoint, *folder);
  if (!server) return server.error();
  return TlsContext::for_client(server->identity, server->authority_pem);
}

}  // namespace handloft::net
