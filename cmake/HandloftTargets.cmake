# How every target of ours is built: include paths from the repository root, warnings, sanitizers, ccache.

find_program(HANDLOFT_CCACHE ccache)
if(HANDLOFT_CCACHE)
  # Relative paths in the hash let a second checkout share the cache.
  set(CMAKE_CXX_COMPILER_LAUNCHER ${CMAKE_COMMAND} -E env
      CCACHE_BASEDIR=${CMAKE_SOURCE_DIR} CCACHE_NOHASHDIR=1 ${HANDLOFT_CCACHE})
  set(CMAKE_C_COMPILER_LAUNCHER ${CMAKE_CXX_COMPILER_LAUNCHER})
endif()

add_library(handloft_options INTERFACE)
target_include_directories(handloft_options INTERFACE "${CMAKE_SOURCE_DIR}")
# No fused multiply-add contraction: the same operations give the same bits on every machine (X2).
target_compile_options(handloft_options INTERFACE
  -Wall -Wextra -Wpedantic -Wshadow -Wconversion -ffp-contract=off)
if(HANDLOFT_SANITIZE)
  # Global, so that the generated protobuf code is instrumented alike.
  add_compile_options(-fsanitize=${HANDLOFT_SANITIZE} -fno-omit-frame-pointer
                      -fno-sanitize-recover=all)
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    # GCC's sanitizer instrumentation makes this warning cry wolf in other people's templates.
    target_compile_options(handloft_options INTERFACE -Wno-maybe-uninitialized)
  endif()
  add_link_options(-fsanitize=${HANDLOFT_SANITIZE})
endif()
if(HANDLOFT_BUILD_FUZZERS)
  if(NOT CMAKE_CXX_COMPILER_ID MATCHES "Clang")
    message(FATAL_ERROR "HANDLOFT_BUILD_FUZZERS needs clang (use the preset 'fuzz')")
  endif()
  add_compile_options(-fsanitize=fuzzer-no-link)
  add_custom_target(fuzzers)  # All of them, and nothing else.
endif()

# handloft_rooms(NAME ...): the folders of these names that have a CMakeLists.txt. The tests' folders mirror the tree,
# and not every room has tests of every kind.
function(handloft_rooms)
  foreach(room IN LISTS ARGN)
    if(EXISTS "${CMAKE_CURRENT_SOURCE_DIR}/${room}/CMakeLists.txt")
      add_subdirectory(${room})
    endif()
  endforeach()
endfunction()

# The top folders that this build has: common, and the programs that are not switched off.
set(HANDLOFT_ROOMS common)
if(HANDLOFT_BUILD_TRACKD)
  list(APPEND HANDLOFT_ROOMS daemon-tracking)
endif()
if(HANDLOFT_BUILD_MODELD)
  list(APPEND HANDLOFT_ROOMS server-model)
endif()
if(HANDLOFT_BUILD_HMD)
  list(APPEND HANDLOFT_ROOMS client-hmd)
endif()

# handloft_library(NAME SOURCES a.cpp ... LINK public_dep ... PRIVATE_LINK dep ...)
# A static library of one room. NAME is handloft_<room>.
function(handloft_library name)
  cmake_parse_arguments(ARG "" "" "SOURCES;LINK;PRIVATE_LINK" ${ARGN})
  add_library(${name} STATIC ${ARG_SOURCES})
  target_link_libraries(${name} PUBLIC ${ARG_LINK} PRIVATE handloft_options ${ARG_PRIVATE_LINK})
  target_include_directories(${name} PUBLIC "${CMAKE_SOURCE_DIR}")
endfunction()

# handloft_program(NAME SOURCES ... LINK ...): an installed executable.
function(handloft_program name)
  cmake_parse_arguments(ARG "" "" "SOURCES;LINK" ${ARGN})
  add_executable(${name} ${ARG_SOURCES})
  target_link_libraries(${name} PRIVATE handloft_options ${ARG_LINK})
  install(TARGETS ${name} RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
endfunction()

# handloft_test(NAME SOURCES ... LINK ... [LABELS ...] [TIMEOUT s] [SERIAL]): a GoogleTest executable, one ctest
# entry per TEST. SERIAL: nothing runs beside it.
function(handloft_test name)
  cmake_parse_arguments(ARG "SERIAL" "TIMEOUT" "SOURCES;LINK;LABELS" ${ARGN})
  if(NOT ARG_TIMEOUT)
    set(ARG_TIMEOUT 120)
  endif()
  if(NOT ARG_LABELS)
    set(ARG_LABELS unit)
  endif()
  add_executable(${name} ${ARG_SOURCES})
  target_link_libraries(${name} PRIVATE handloft_options ${ARG_LINK} handloft_test_support
                        GTest::gmock_main)
  gtest_discover_tests(${name} DISCOVERY_MODE PRE_TEST WORKING_DIRECTORY "${CMAKE_SOURCE_DIR}"
                       PROPERTIES TIMEOUT ${ARG_TIMEOUT} LABELS "${ARG_LABELS}"
                                  RUN_SERIAL ${ARG_SERIAL})
endfunction()

# handloft_bench(NAME SOURCES ... LINK ...): a Google Benchmark executable; never part of ctest.
function(handloft_bench name)
  cmake_parse_arguments(ARG "" "" "SOURCES;LINK" ${ARGN})
  if(NOT HANDLOFT_BUILD_BENCH)
    return()
  endif()
  add_executable(${name} ${ARG_SOURCES})
  target_link_libraries(${name} PRIVATE handloft_options ${ARG_LINK} benchmark::benchmark_main)
endfunction()

# handloft_fuzzer(NAME SOURCES ... LINK ...): a libFuzzer target; its seeds lie in tests/fuzz/corpus/NAME.
function(handloft_fuzzer name)
  cmake_parse_arguments(ARG "" "" "SOURCES;LINK" ${ARGN})
  if(NOT HANDLOFT_BUILD_FUZZERS)
    return()
  endif()
  add_executable(${name} ${ARG_SOURCES})
  target_link_libraries(${name} PRIVATE handloft_options ${ARG_LINK})
  target_link_options(${name} PRIVATE -fsanitize=fuzzer)
  add_dependencies(fuzzers ${name})
endfunction()
