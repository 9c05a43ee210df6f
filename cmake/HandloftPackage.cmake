# `cpack --config build/release/CPackConfig.cmake` makes a .deb of the installed prefix.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME handloft)
set(CPACK_PACKAGE_VENDOR "Handloft")
set(CPACK_PACKAGE_CONTACT "Handloft maintainers <maintainers@handloft.invalid>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "${PROJECT_DESCRIPTION}")
set(CPACK_RESOURCE_FILE_LICENSE "${CMAKE_SOURCE_DIR}/LICENSE")
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION graphics)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
# Loaded when a glove or 3D mouse is opened: no linker knows.
set(CPACK_DEBIAN_PACKAGE_DEPENDS "libhidapi-hidraw0, libhidapi-libusb0")
set(CPACK_STRIP_FILES ON)
include(CPack)

install(FILES "${CMAKE_SOURCE_DIR}/LICENSE" DESTINATION ${CMAKE_INSTALL_DOCDIR})
