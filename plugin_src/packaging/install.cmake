# What `cmake --install` lays down, and the package of Debian that cpack makes of it. All finds itself by its own place: the
# folder may be moved.
include(GNUInstallDirs)
set(SUNDER_PYTHON_DIR lib/python3/dist-packages CACHE STRING "Folder of the Python package, below the prefix")

install(TARGETS sunder)
install(TARGETS sunder_c EXPORT Sunder INCLUDES DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
install(FILES c_api/sunder.h TYPE INCLUDE)
install(FILES ${PROJECT_SOURCE_DIR}/LICENSE DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/sunder RENAME copyright)

# find_package(Sunder): as long as versions begin with 0 a minor one may change what it likes, the library's name with it.
include(CMakePackageConfigHelpers)
set(config ${CMAKE_INSTALL_LIBDIR}/cmake/Sunder)
write_basic_package_version_file(${PROJECT_BINARY_DIR}/SunderConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/SunderConfigVersion.cmake DESTINATION ${config})
install(EXPORT Sunder NAMESPACE Sunder:: FILE SunderConfig.cmake DESTINATION ${config})

# The Python package looks for the library beside itself.
file(RELATIVE_PATH library ${CMAKE_INSTALL_PREFIX}/${SUNDER_PYTHON_DIR}/sunder ${CMAKE_INSTALL_FULL_LIBDIR}/libsunder.so)
file(MAKE_DIRECTORY ${PROJECT_BINARY_DIR}/installed)
file(CREATE_LINK ${library}.${PROJECT_VERSION} ${PROJECT_BINARY_DIR}/installed/libsunder.so SYMBOLIC)
install(FILES ${PROJECT_BINARY_DIR}/installed/libsunder.so DESTINATION ${SUNDER_PYTHON_DIR}/sunder)
install(DIRECTORY python/sunder DESTINATION ${SUNDER_PYTHON_DIR} 
  FILES_MATCHING PATTERN *.py PATTERN *.pyi PATTERN py.typed)

if(PROJECT_IS_TOP_LEVEL)
  set(CPACK_GENERATOR DEB)
  set(CPACK_PACKAGE_CONTACT "Sunder <sunder@localhost>")
  set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "ductile fracture with oriented particles")
  set(CPACK_PACKAGE_DESCRIPTION "A solid mesh is cut into pieces, simulated as oriented particles that
dent, flow and tear apart, and comes back as a mesh that is watertight
until it breaks. The package holds the program, the C library with its
header, and the package for Python.")
  set(CPACK_RESOURCE_FILE_LICENSE ${PROJECT_SOURCE_DIR}/LICENSE)
  set(CPACK_STRIP_FILES ON)
  set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
  set(CPACK_DEBIAN_PACKAGE_SECTION graphics)
  set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
  set(CPACK_DEBIAN_PACKAGE_GENERATE_SHLIBS ON)
  set(CPACK_DEBIAN_PACKAGE_RECOMMENDS python3-numpy)
  include(CPack)
endif()
