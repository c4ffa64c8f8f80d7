// main file
within folder_package_mo;
model Main
  Part part;
  // expect: part.y @ 1 = 3
end Main;
