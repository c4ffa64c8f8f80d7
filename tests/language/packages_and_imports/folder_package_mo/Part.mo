within folder_package_mo;
model Part
  Real y = 3;
end Part;
