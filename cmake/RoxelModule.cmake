# roxel_module(NAME SOURCES a.cc ... [PUBLIC lib ...] [PRIVATE lib ...] [TESTS a_test.cc ...] [TEST_LIBS lib ...])
#
# One folder, one concept, one target: roxel_NAME (alias roxel::NAME), and NAME_test from the *_test.cc
# files beside the sources. Tests carry the module's name as label: ctest -L NAME.
add_library(roxel_flags INTERFACE)
target_compile_options(roxel_flags INTERFACE
  -Wall -Wextra -Wshadow -Wno-sign-compare -fno-math-errno -fno-trapping-math)
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_CXX_COMPILER_VERSION VERSION_LESS 13)
  # GCC 12 sees overlaps and overruns in "a" + std::string.
  target_compile_options(roxel_flags INTERFACE -Wno-restrict -Wno-array-bounds -Wno-stringop-overflow
    -Wno-stringop-overread)
endif()
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  # Files are large: a compiler that tidies its memory less often is up to a seventh faster, and takes up to 2 GB.
  target_compile_options(roxel_flags INTERFACE "SHELL:--param ggc-min-heapsize=1000000")
endif()
if(ROXEL_SANITIZE)
  target_compile_options(roxel_flags INTERFACE -fsanitize=${ROXEL_SANITIZE} -fno-omit-frame-pointer)
  if(ROXEL_SANITIZE MATCHES undefined)
    # That is for what is tested: in the tests' own long functions it takes two thirds of the time to compile.
    target_compile_options(roxel_flags INTERFACE $<$<BOOL:$<TARGET_PROPERTY:ROXEL_IS_TEST>>:-fno-sanitize=undefined>)
  endif()
  target_link_options(roxel_flags INTERFACE -fsanitize=${ROXEL_SANITIZE})
endif()

# Modules whose tests are quick enough to be run under sanitizers on every change (.ci/run):
# cmake --build --preset asan --target sanitizer_tests && ctest --preset asan -L sanitizer
set(ROXEL_SANITIZER_MODULES base color camera image volume dataset march infer)
add_custom_target(sanitizer_tests)

# The headers that nearly every file reads take longer to parse than most files take to compile: parsed once
# for the modules and once for their tests.
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  set(ROXEL_PRECOMPILED_HEADERS_DEFAULT ON)
else()
  set(ROXEL_PRECOMPILED_HEADERS_DEFAULT OFF)
endif()
option(ROXEL_PRECOMPILED_HEADERS "Parse common headers once" ${ROXEL_PRECOMPILED_HEADERS_DEFAULT})
# For the same reason several files of a module are compiled as one: a third of the time. Names in anonymous
# namespaces must thus be unique within a module. The dev preset has it off: there one file is built at a time.
option(ROXEL_UNITY_BUILD "Compile several files of a module as one" ${ROXEL_PRECOMPILED_HEADERS_DEFAULT})
set(CMAKE_UNITY_BUILD ${ROXEL_UNITY_BUILD})
set(CMAKE_UNITY_BUILD_BATCH_SIZE 16)

# roxel_precompile(TARGET OWNER HEADER ...): TARGET uses OWNER's precompiled headers, OWNER's own are made.
function(roxel_precompile target owner)
  if(NOT ROXEL_PRECOMPILED_HEADERS)
    return()
  endif()
  target_compile_options(${target} PRIVATE -fpch-preprocess)  # lets compiler caches see what is inside
  if(target STREQUAL owner)
    target_link_libraries(${target} PRIVATE $<BUILD_INTERFACE:Eigen3::Eigen> $<BUILD_INTERFACE:nlohmann_json::nlohmann_json>)
    target_precompile_headers(${target} PRIVATE ${ARGN})
  else()
    target_precompile_headers(${target} REUSE_FROM ${owner})
  endif()
endfunction()

function(roxel_module name)
  cmake_parse_arguments(ARG "" "" "SOURCES;PUBLIC;PRIVATE;TESTS;TEST_LIBS" ${ARGN})
  add_library(roxel_${name} STATIC ${ARG_SOURCES})
  add_library(roxel::${name} ALIAS roxel_${name})
  set_target_properties(roxel_${name} PROPERTIES EXPORT_NAME ${name})
  target_include_directories(roxel_${name} PUBLIC
    $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/src> $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
  target_compile_features(roxel_${name} PUBLIC cxx_std_20)
  target_link_libraries(roxel_${name} PUBLIC ${ARG_PUBLIC} PRIVATE ${ARG_PRIVATE} $<BUILD_INTERFACE:roxel_flags>)
  roxel_precompile(roxel_${name} roxel_base
    <Eigen/Geometry> <algorithm> <array> <cmath> <cstdint> <filesystem> <functional> <memory>
    <nlohmann/json.hpp> <string> <vector>)
  install(TARGETS roxel_${name} EXPORT roxelTargets)
  install(DIRECTORY ${CMAKE_CURRENT_SOURCE_DIR}/ DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/roxel/${name}
          FILES_MATCHING PATTERN "*.h"
          PATTERN "*_fixture.h" EXCLUDE PATTERN "*_twin.h" EXCLUDE PATTERN "test_*.h" EXCLUDE PATTERN "temp_folder.h" EXCLUDE)
  if(ROXEL_BUILD_TESTS AND ARG_TESTS)
    roxel_module_test(${name} "${ARG_TESTS}" "${ARG_TEST_LIBS}")
  endif()
endfunction()

# Sources of the module just made that Highway compiles once for each instruction set, including them anew
# each time. Products that are rounded before they are summed stay so.
function(roxel_vector_kernels)
  set_source_files_properties(${ARGN} PROPERTIES
    COMPILE_OPTIONS "-O3;-ffp-contract=off" SKIP_UNITY_BUILD_INCLUSION ON SKIP_PRECOMPILE_HEADERS ON)
endfunction()

function(roxel_module_test name sources libraries)
  add_executable(${name}_test ${sources})
  target_link_libraries(${name}_test PRIVATE roxel_${name} ${libraries} roxel_flags
                        GTest::gmock GTest::gtest_main rapidcheck_gtest)
  target_compile_definitions(${name}_test PRIVATE ROXEL_SOURCE_DIR="${PROJECT_SOURCE_DIR}")
  # Tests run once: -O1 compiles them in half the time.
  target_compile_options(${name}_test PRIVATE $<$<CONFIG:Release>:-O1>)
  set_target_properties(${name}_test PROPERTIES ROXEL_IS_TEST ON)
  roxel_precompile(${name}_test base_test
    <Eigen/Geometry> <algorithm> <filesystem> <functional> <gmock/gmock.h> <gtest/gtest.h>
    <nlohmann/json.hpp> <rapidcheck/gtest.h> <string> <vector>)
  set(label ${name})
  if(name IN_LIST ROXEL_SANITIZER_MODULES)
    add_dependencies(sanitizer_tests ${name}_test)
    set(label sanitizer.${name})
  endif()
  gtest_discover_tests(${name}_test DISCOVERY_MODE PRE_TEST PROPERTIES TIMEOUT 300 LABELS ${label})
endfunction()
