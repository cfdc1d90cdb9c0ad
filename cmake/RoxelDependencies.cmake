# Every library that roxel stands on; docs/dependencies.md lists them with their licences. A library that is
# added here is also added to roxelConfig.cmake.in, tools/setup.sh and docs/dependencies.md.
set(THREADS_PREFER_PTHREAD_FLAG ON)
find_package(Threads REQUIRED)
find_package(TBB REQUIRED)
find_package(Eigen3 3.4 REQUIRED NO_MODULE)
find_package(nlohmann_json 3.10 REQUIRED)
find_package(CLI11 REQUIRED)
list(APPEND CMAKE_MODULE_PATH ${CMAKE_PREFIX_PATH} /usr/lib/${CMAKE_LIBRARY_ARCHITECTURE}/cmake/OpenVDB)
# These two look for Imath, and Debian's Imath complains of Python bindings that nobody asked for: keep that
# out of the output.
set(CMAKE_MESSAGE_LOG_LEVEL WARNING)
find_package(OpenImageIO REQUIRED)
find_package(OpenVDB REQUIRED)
unset(CMAKE_MESSAGE_LOG_LEVEL)
if(ROXEL_BUILD_TESTS)
  find_package(GTest REQUIRED)
  find_package(rapidcheck REQUIRED)
  find_package(Python3 REQUIRED COMPONENTS Interpreter)
  include(GoogleTest)
endif()
if(ROXEL_BUILD_BENCHMARKS)
  find_package(benchmark REQUIRED)
endif()
