#include "client-hmd/main/app.h"

#include <cstdio>
#include <filesystem>
#include <iostream>

#include "client-hmd/display/window_display.h"
#include "client-hmd/main/end_signal.h"
#include "client-hmd/main/frame_loop.h"
#include "client-hmd/main/open_display.h"
#include "client-hmd/main/shoot.h"
#include "common/net/endpoint.h"
#include "common/net/paired_server.h"

namespace handloft::client {
namespace {

/// Who was invited as less may have become more since, and the server says what they are; owners come as
/// such.
Invited invited_by(const net::Endpoint& model) {
  if (model.kind != net::Endpoint::Kind::tls) return Invited::somebody;
  const Result<std::filesystem::path> folder = net::paired_servers_folder();
  if (!folder) return Invited::somebody;
  const Result<net::PairedServer> server = net::find_paired_server(model, *folder);
  return server && server->role == "owner" ? Invited::owner : Invited::somebody;
}

}  // namespace

Status run_hmd(const HmdOptions& options, const Logger& log) {
  if (options.monitors) {
    const Result<std::vector<MonitorInfo>> monitors = list_monitors();
    if (!monitors) return monitors.error();
    std::fputs(describe(*monitors).c_str(), stdout);
    return {};
  }
  Result<net::Endpoint> model =
      options.model ? Result<net::Endpoint>(*options.model) : net::default_model_endpoint();
  if (!model) return model.error();
  if (!options.pair.empty()) {
    const Result<std::filesystem::path> folder = net::paired_servers_folder();
    if (!folder) return folder.error();
    const Result<net::PairedServer> paired = net::pair(*model, options.pair, {}, *folder);
    if (!paired) return paired.error();
    log.info("paired with {} as \"{}\", {}; from now on without --pair", paired->endpoint, paired->user,
             paired->role);
  }
  const Result<std::shared_ptr<const net::TlsContext>> tls = net::tls_to(*model);
  if (!tls && tls.error().code == ErrorCode::failed_precondition) {
    return make_error(ErrorCode::permission_denied, tls.error().message, "model");  // Not let in.
  }
  if (!tls) return tls.error();
  EndSignal end_signal(log);  // Before any thread: all of them inherit the mask.
  const SystemClock clock;
  Feeds feeds(options, *model, clock, log, *tls, invited_by(*model));
  Result<std::unique_ptr<Display>> display = open_display(options, log);
  if (!display) return display.error();
  if (options.shots.wanted()) {
    return shoot(
        {options, clock, feeds, std::cout}, [&end_signal] { return end_signal.came(); }, log);
  }
  std::unique_ptr<Metrics> metrics;
  if (options.metrics) {
    const Result<net::Endpoint> endpoint = net::parse_endpoint(*options.metrics);
    if (!endpoint) return endpoint.error();
    Result<std::unique_ptr<Metrics>> serving = Metrics::serve(*endpoint, log.component("metrics"));
    if (!serving) return serving.error();
    metrics = std::move(*serving);
    log.info("metrics at {}", metrics->endpoint().to_string());
  }
  // Destroyed before its display: it holds the display's OpenGL objects.
  Result<std::unique_ptr<FrameLoop>> loop =
      FrameLoop::create({options, clock, feeds, **display, metrics.get()}, log);
  if (!loop) return loop.error();
  if (const Status status = (*loop)->run([&end_signal] { return end_signal.came(); }); !status) return status;
  const RunFigures figures = (*loop)->figures();
  if (options.stats) log.info("{}", describe(figures.photons, figures.frame_time));
  if (options.report.empty()) return {};
  return write_text(options.report, report_json(figures));
}

}  // namespace handloft::client
