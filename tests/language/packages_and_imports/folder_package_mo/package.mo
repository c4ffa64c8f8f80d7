within;
package folder_package_mo
end folder_package_mo;
