# Installs the libraries with headers and a package configuration, so that an outside project can say
# find_package(scanview) and link scanview::viewer (tests/consumer does).
include(CMakePackageConfigHelpers)

get_property(scanview_libraries GLOBAL PROPERTY SCANVIEW_LIBRARIES)
install(TARGETS ${scanview_libraries} EXPORT scanview_targets)
install(EXPORT scanview_targets FILE scanview-targets.cmake NAMESPACE scanview:: DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/scanview)
foreach(folder base calib acquire register mesh synth viewer)
  install(DIRECTORY ${folder} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/scanview FILES_MATCHING PATTERN "*.h")
endforeach()
configure_package_config_file(cmake/scanview-config.cmake.in ${CMAKE_CURRENT_BINARY_DIR}/scanview-config.cmake
  INSTALL_DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/scanview)
write_basic_package_version_file(${CMAKE_CURRENT_BINARY_DIR}/scanview-config-version.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/scanview-config.cmake ${CMAKE_CURRENT_BINARY_DIR}/scanview-config-version.cmake
  DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/scanview)
