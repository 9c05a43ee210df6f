// Writes what each simulated camera sees at some times as JPEG files, to look at:
//   simulated_rig_frames FOLDER mouse|tour [seconds ...]

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <string>
#include <vector>

#include "daemon-tracking/source/simulated/camera_renderer.h"
#include "daemon-tracking/source/simulated/mouse_shell.h"
#include "daemon-tracking/source/simulated/simulated_rig.h"
#include "daemon-tracking/source/simulated/tour_program.h"

int main(int argc, char** argv) {
  using namespace handloft::tracking;
  if (argc < 3) {
    std::cerr << "usage: simulated_rig_frames FOLDER mouse|tour [seconds ...]\n";
    return 2;
  }
  const std::filesystem::path folder = argv[1];
  std::filesystem::create_directories(folder);
  const HandProgram program = std::string(argv[2]) == "tour" ? tour_program() : mouse_shell_program();
  std::cout << "program: " << program.duration_s() << " s\n";
  for (const HandEvent& event : program.events()) {
    std::cout << "  " << event.begin_s << " .. " << event.end_s << "  " << event.label << "\n";
  }
  std::vector<double> times;
  for (int i = 3; i < argc; ++i) times.push_back(std::strtod(argv[i], nullptr));
  const Rig rig = default_rig();
  const HeadMotion head;
  constexpr double third_s = 0.002;
  for (std::size_t camera = 0; camera < rig.cameras.size(); ++camera) {
    CameraRenderer renderer(rig, camera, ImageOptions{});
    for (const double time : times) {
      const Exposure exposure{program.at(time - third_s), program.at(time), program.at(time + third_s),
                              head.at(time)};
      const auto jpeg = renderer.render(exposure, 1);
      if (!jpeg) {
        std::cerr << jpeg.error().describe() << "\n";
        return 1;
      }
      const auto path =
          folder / (rig.cameras[camera].name + "_" + std::to_string(time).substr(0, 5) + ".jpg");
      std::ofstream(path, std::ios::binary)
          .write(reinterpret_cast<const char*>(jpeg->data()), static_cast<std::streamsize>(jpeg->size()));
      std::cout << path.string() << " " << jpeg->size() << " bytes\n";
    }
  }
  return 0;
}
