# scanview_library(NAME SOURCES ... PUBLIC ... PRIVATE ... [PRECOMPILE]): the library of one folder, alias scanview::NAME.
# PUBLIC and PRIVATE name what it links. Headers are included from the root of the tree: "mesh/view_mesh.h".
# PRECOMPILE is for what the sanitizer builds, without, compile as well: there a header that misses an include is found.
function(scanview_library name)
  cmake_parse_arguments(ARG "PRECOMPILE" "" "SOURCES;PUBLIC;PRIVATE" ${ARGN})
  add_library(scanview_${name} STATIC ${ARG_SOURCES})
  add_library(scanview::${name} ALIAS scanview_${name})
  set_target_properties(scanview_${name} PROPERTIES EXPORT_NAME ${name})
  target_include_directories(scanview_${name} PUBLIC $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}>
                                                     $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}/scanview>)
  target_link_libraries(scanview_${name} PUBLIC ${ARG_PUBLIC} PRIVATE ${ARG_PRIVATE})
  scanview_compile_options(scanview_${name})
  if(ARG_PRECOMPILE)
    scanview_precompile(scanview_${name} scanview_precompiled)
  endif()
  set_property(GLOBAL APPEND PROPERTY SCANVIEW_LIBRARIES scanview_${name})
endfunction()

# Warnings (errors at top level) and arithmetic that is the same in every build.
function(scanview_compile_options target)
  target_compile_features(${target} PUBLIC cxx_std_20)
  target_compile_options(${target} PRIVATE -ffp-contract=off -Wall -Wextra)
  if(CMAKE_CXX_COMPILER_ID MATCHES Clang)
    target_compile_options(${target} PRIVATE -Wno-unknown-pragmas)   # GCC's, for faster loops
  endif()
  if(PROJECT_IS_TOP_LEVEL)
    target_compile_options(${target} PRIVATE -Werror)
  endif()
endfunction()

# Lets `target` read the precompiled headers of target `from`. (Headers of other libraries only: they cost more to read
# than our own code does.)
function(scanview_precompile target from)
  if(NOT SCANVIEW_PRECOMPILE)
    return()
  endif()
  if(target STREQUAL from)
    target_precompile_headers(${target} PRIVATE <algorithm> <array> <cmath> <filesystem> <functional> <map> <optional>
      <string> <vector> <nlohmann/json.hpp> <Eigen/Dense> <opencv2/core.hpp> ${ARGN})
  else()
    target_precompile_headers(${target} REUSE_FROM ${from})
  endif()
  if(CMAKE_CXX_COMPILER_ID STREQUAL GNU)
    target_compile_options(${target} PRIVATE -fpch-preprocess)   # for ccache
  endif()
endfunction()
