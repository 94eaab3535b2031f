"""Registry of one robot: installed modules and their states; every change is proved first and atomic."""
